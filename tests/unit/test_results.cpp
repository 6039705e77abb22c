#include "base/error.h"
#include "contact/convex_core.h"
#include "contact/instrument_surface.h"
#include "convex_meshes.h"
#include "embedding/skin.h"
#include "fem/solid_model.h"
#include "formats/curves/number_table.h"
#include "formats/mesh/ply.h"
#include "formats/results/results.h"
#include "formats/results/results_writer.h"
#include "formats/store/hdf5_internal.h"
#include "scratch.h"
#include "sim_models.h"
#include "tests/unit/complaint.h"
#include "tet_fixtures.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>

namespace gewebe::test {
namespace {

/// A folder of its own, removed with all that is in it.
class ScratchFolder {
public:
  ScratchFolder() : path_(std::filesystem::temp_directory_path() / "gewebe-test-XXXXXX") {
    std::string name = path_.string();
    if (::mkdtemp(name.data()) == nullptr)
      throw std::runtime_error("no scratch folder");
    path_ = name;
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
  }

private:
  std::filesystem::path path_;
};

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

model::Model textured() {
  model::Model model = test::organ(1);
  model.texcoords.assign(model.triangles.size(), {0, 0.25, 0.5, 0.75, 1, 0.125});
  model.name = "Größe <&>";
  return model;
}

/// Two objects, the second from the second frame on; displacement k / 8 of value k.
void write(formats::Kind kind, const std::string& path, const model::Model& a,
           const model::Model& b, formats::TableRows rows = formats::TableRows::frame) {
  const std::unique_ptr<formats::ResultWriter> result = formats::open_result(
      kind, path, formats::Output::Options{.binary = formats::is_binary(kind)}, rows);
  std::vector<double> ua(3 * a.nodes.size()), ub(3 * b.nodes.size());
  const std::vector<contact::NodeVector> none, forces{{3, {1, 2, 3}}, {7, {-0.5, 0, 1e-3}}};
  result->add_object("z-a", a);
  result->add_frame(0, std::vector<formats::FrameObject>{{ua, none}});
  result->add_object("b", b);
  for (std::size_t k = 0; k < ua.size(); ++k)
    ua[k] = static_cast<double>(k) / 8;
  for (std::size_t k = 0; k < ub.size(); ++k)
    ub[k] = -static_cast<double>(k) / 8;
  result->add_frame(0.1, std::vector<formats::FrameObject>{{ua, forces}, {ub, none}});
  result->add_frame(1, std::vector<formats::FrameObject>{{ua, none}, {ub, forces}});
  result->commit();
}

/// A sphere that moves, goes and comes again as a capsule; another from the last frame on.
void write_instruments(formats::Kind kind, const std::string& path, const model::Model& model) {
  const std::unique_ptr<formats::ResultWriter> result = formats::open_result(
      kind, path, formats::Output::Options{.binary = formats::is_binary(kind)});
  const std::vector<double> u(3 * model.nodes.size());
  const contact::Pose turned{{5, 0, 1}, contact::turn_about({0, 0, 1}, 90)};
  result->add_object("o", model);
  result->add_frame(0, std::vector<formats::FrameObject>{{u, {}}});
  std::vector<formats::FrameInstrument> all{{"probe",
                                             true,
                                             {.radius = 2, .axis = {}, .friction = 0.5},
                                             {{1, 2, 3}, {}},
                                             {1, 2, 5},
                                             {0, 0, 9},
                                             {1, 0, 0},
                                             4}};
  const auto add = [&](double time) {
    result->set_instruments(all);
    result->add_frame(time, std::vector<formats::FrameObject>{{u, {}}});
  };
  add(1);
  all[0].pose = {{1, 2, 2}, {}};
  add(2);
  all[0].present = false;
  add(3);
  all[0] = {"probe", true, {.radius = 1, .axis = {4, 0, 0}}, turned, {}, {}, {}, 0};
  all.push_back(
      {"knife", true, {.radius = 0, .axis = {0, 0, 8}, .blade = true}, {}, {}, {}, {}, 0});
  add(4);
  contact::InstrumentShape jaw{0.25, {}, 0};
  jaw.core = std::make_shared<const contact::ConvexCore>(test::divided_box({2, 3, 4}, 2));
  all[1] = {"knife", true, jaw, turned, {}, {}, {}, 0};
  add(5);
  all[1].pose.place.x += 1;
  add(6);
  result->commit();
}

TEST(Results, InstrumentsAreReadAsTheyWereWritten) {
  const ScratchFolder folder;
  const std::string path = folder / "run.h5";
  write_instruments(formats::Kind::hdf5, path, test::organ(1));
  EXPECT_EQ(formats::read_result_index(path).instruments,
            (std::vector<std::string>{"probe", "knife"}));
  EXPECT_TRUE(formats::read_result_instruments(path, 0).empty());
  EXPECT_TRUE(formats::read_result_instruments(path, 3).empty());
  const std::vector<formats::ResultInstrument> second = formats::read_result_instruments(path, 2);
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(second[0].name, "probe");
  EXPECT_EQ(second[0].kind, contact::InstrumentKind::sphere);
  EXPECT_EQ(second[0].radius, 2);
  EXPECT_EQ(second[0].friction, 0.5);
  EXPECT_EQ(second[0].place, (Vec3{1, 2, 2}));
  EXPECT_EQ(second[0].ends[1], second[0].place);
  EXPECT_EQ(second[0].force, (Vec3{0, 0, 9}));
  EXPECT_EQ(second[0].torque, (Vec3{1, 0, 0}));
  EXPECT_EQ(second[0].touched, 4U);
  const std::vector<formats::ResultInstrument> last = formats::read_result_instruments(path, 4);
  ASSERT_EQ(last.size(), 2U);
  EXPECT_EQ(last[0].kind, contact::InstrumentKind::capsule);
  EXPECT_LT(norm(last[0].ends[1] - Vec3{5, 4, 1}), 1e-15);
  EXPECT_LT(norm(last[0].rotation[1] - Vec3{1, 0, 0}), 1e-15);
  EXPECT_EQ(last[1].kind, contact::InstrumentKind::blade);
  const std::vector<formats::ResultInstrument> mesh = formats::read_result_instruments(path, 6);
  ASSERT_EQ(mesh.size(), 2U);
  EXPECT_EQ(mesh[1].kind, contact::InstrumentKind::mesh);
  EXPECT_EQ(mesh[1].radius, 0.25);
  EXPECT_TRUE(mesh[0].surface.points.empty());
  const contact::InstrumentSurface shown =
      contact::hull_surface(contact::ConvexCore(test::divided_box({2, 3, 4}, 2)), 0.25);
  const contact::Pose stands{{6, 0, 1}, contact::turn_about({0, 0, 1}, 90)};
  ASSERT_EQ(mesh[1].surface.points.size(), shown.points.size());
  EXPECT_EQ(mesh[1].surface.triangles, shown.triangles);
  for (std::size_t i = 0; i < shown.points.size(); ++i) {
    EXPECT_LT(norm(mesh[1].surface.points[i] - stands(shown.points[i])), 1e-6);
    const auto& [x, y, z] = mesh[1].surface.normals[i];
    EXPECT_LT(norm(Vec3{x, y, z} - shown.normals[i]), 1e-6);
  }
  EXPECT_THROW((void)formats::read_result_instruments(path, 7), Error);
  // Nothing of it where there are none, whose bytes are those of before.
  write(formats::Kind::hdf5, folder / "bare.h5", test::organ(1), test::two_masses());
  EXPECT_TRUE(formats::read_result_index(folder / "bare.h5").instruments.empty());
  EXPECT_TRUE(formats::read_result_instruments(folder / "bare.h5", 1).empty());
  EXPECT_FALSE(formats::hdf5::File::open(folder / "bare.h5").root().has("instruments"));
}

TEST(Results, InstrumentsThatAreDamagedAreErrors) {
  const ScratchFolder folder;
  const std::string path = folder / "run.h5";
  const auto make = [&](double radius, std::uint64_t rows, std::uint8_t kind, double turned = 0) {
    formats::hdf5::File file = formats::hdf5::File::create(path);
    formats::hdf5::Group& root = file.root();
    root.set("format", "gewebe_results");
    root.set("version", std::uint32_t{1});
    root.write("time", std::vector<double>{0, 1});
    formats::hdf5::Group probe = root.create_group("instruments").create_group("probe");
    probe.set("order", std::uint32_t{0});
    probe.set("first_frame", std::uint64_t{0});
    probe.write("kind", std::vector<std::uint8_t>(2, kind));
    probe.write("touched", std::vector<std::uint32_t>(2));
    probe.write("radius", std::vector<double>(rows, radius));
    probe.write("friction", std::vector<double>(2));
    const std::vector<double> zeros(12);
    std::vector<double> pose;
    for (int k = 0; k < 2; ++k)
      pose.insert(pose.end(), {1, turned, 0, 4, 0, 1, 0, 5, 0, 0, 1, 6});
    probe.write("ends", std::span(zeros).first(12), {2, 2, 3});
    probe.write("pose", std::span<const double>(pose), {2, 3, 4});
    probe.write("force", std::span(zeros).first(6), {2, 3});
    probe.write("torque", std::span(zeros).first(6), {2, 3});
    file.close();
  };
  make(1, 2, 1);
  EXPECT_EQ(formats::read_result_instruments(path, 1).size(), 1U);
  make(1, 2, 200); // of a kind to come
  EXPECT_TRUE(formats::read_result_instruments(path, 1).empty());
  make(-1, 2, 1);
  EXPECT_THROW((void)formats::read_result_instruments(path, 1), Error);
  make(std::nan(""), 2, 1);
  EXPECT_THROW((void)formats::read_result_instruments(path, 1), Error);
  make(1, 1, 1);
  EXPECT_THROW((void)formats::read_result_instruments(path, 1), Error);
  make(1, 2, 1, 0.1); // which would draw it askew
  EXPECT_THROW((void)formats::read_result_instruments(path, 1), Error);
  make(1, 2, 1, std::nan(""));
  EXPECT_THROW((void)formats::read_result_instruments(path, 1), Error);
}

TEST(Results, WhatIsWrittenIsRead) {
  const ScratchFolder folder;
  const model::Model a = textured(), b = test::two_masses();
  const std::string path = folder / "run.h5";
  write(formats::Kind::hdf5, path, a, b);
  EXPECT_EQ(folder.files(), 2U); // and run.xdmf
  const formats::ResultIndex index = formats::read_result_index(path);
  EXPECT_EQ(index.objects,
            (std::vector<std::string>{"z-a", "b"})); // of the scene, not the alphabet
  EXPECT_EQ(index.times, (std::vector<double>{0, 0.1, 1}));
  const formats::ResultSurface first = formats::read_result_surface(path, "z-a", 0);
  const formats::ResultSurface second = formats::read_result_surface(path, "z-a", 1);
  const TriangleMesh surface = model::surface_mesh(a);
  EXPECT_EQ(first.mesh.points, surface.points);
  EXPECT_EQ(first.rest, surface.points);
  EXPECT_EQ(second.rest, surface.points);
  EXPECT_EQ(second.mesh.triangles, surface.triangles);
  EXPECT_EQ(second.mesh.texcoords, surface.texcoords);
  ASSERT_EQ(second.mesh.points.size(), surface.points.size());
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const double k = 3 * static_cast<double>(i);
    EXPECT_EQ(second.mesh.points[i], surface.points[i] + Vec3(k / 8, (k + 1) / 8, (k + 2) / 8));
  }
  // Before it came it was at rest.
  EXPECT_EQ(formats::read_result_surface(path, "b", 0).mesh.points,
            formats::read_result_surface(path, "b", 0).rest);
  EXPECT_NE(formats::read_result_surface(path, "b", 1).mesh.points,
            formats::read_result_surface(path, "b", 0).rest);

  const formats::hdf5::File file = formats::hdf5::File::open(path);
  const formats::hdf5::Group forces = file.root().group("objects").group("z-a").group("forces");
  EXPECT_EQ(forces.read<std::uint64_t>("frame", 2), (std::vector<std::uint64_t>{1, 1}));
  EXPECT_EQ(forces.read<std::uint32_t>("node", 2), (std::vector<std::uint32_t>{3, 7}));
}

TEST(Results, HoldTheSkinOfASolidAndShowIt) {
  const ScratchFolder folder;
  tetrahedra::TetMesh box = test::distorted_box();
  fem::SolidModelOptions options;
  options.material.materials[0].poisson = 0.3;
  model::Model model = fem::solid_model(std::move(box), options, {});
  TriangleMesh surface = test::ball(3, 1.3, {1, 1, 1}); // in and out of the box
  surface.texcoords.assign(surface.triangles.size(), {0.1F, 0, 1, 0.25F, 0.5F, 2});
  (void)embedding::add_skin(model, surface, {}, {});
  const std::vector<double> rest(3 * model.nodes.size());
  std::vector<double> u;
  for (const model::Node& node : model.nodes) {
    const Vec3& p = node.position;
    u.insert(u.end(), {p.x * p.x, p.y - p.z, 1 + p.x * p.z});
  }
  const std::vector<contact::NodeVector> none;
  const std::vector<Vec3> moved =
      embedding::displaced_skin(embedding::skin_weights(model), surface.points, u);
  for (const formats::Kind kind : {formats::Kind::hdf5, formats::Kind::ply}) {
    const std::unique_ptr<formats::ResultWriter> result = formats::open_result(
        kind, folder / (kind == formats::Kind::ply ? "run.ply" : "run.h5"), {.binary = true});
    result->add_object("s", model);
    result->add_frame(0, std::vector<formats::FrameObject>{{rest, none}});
    result->add_frame(1, std::vector<formats::FrameObject>{{u, none}});
    result->commit();
  }
  const std::string path = folder / "run.h5";
  const formats::ResultSurface first = formats::read_result_surface(path, "s", 0);
  EXPECT_EQ(first.mesh.points, surface.points);
  EXPECT_EQ(first.mesh.triangles, surface.triangles);
  EXPECT_EQ(first.mesh.texcoords, surface.texcoords);
  const formats::ResultSurface second = formats::read_result_surface(path, "s", 1);
  EXPECT_EQ(second.rest, surface.points);
  const TriangleMesh last = formats::read_ply(bytes_of(folder / "run.ply"), "run.ply");
  ASSERT_EQ(second.mesh.points.size(), moved.size());
  ASSERT_EQ(last.points.size(), moved.size());
  EXPECT_EQ(last.texcoords, surface.texcoords);
  for (std::size_t p = 0; p < moved.size(); ++p) { // displacements are float32, so is the PLY
    EXPECT_LT(norm(second.mesh.points[p] - moved[p]), 1e-5) << p;
    EXPECT_LT(norm(last.points[p] - moved[p]), 1e-5) << p;
    EXPECT_GT(norm(moved[p] - surface.points[p]), 1e-3) << p;
  }
  // The nodes' own surface is there for values at nodes.
  EXPECT_EQ(formats::read_result_surface(path, "s", 0, false).mesh.points.size(),
            model::surface_count(model));
}

TEST(Results, WhatComesLaterWasAtRestInEveryFrameBefore) {
  const ScratchFolder folder;
  const std::string path = folder / "run.h5";
  const model::Model a = textured(), b = test::organ(1);
  const std::vector<double> ua(3 * a.nodes.size()), ub(3 * b.nodes.size(), 0.5);
  const std::vector<contact::NodeVector> none, forces{{3, {1, 2, 3}}, {7, {-0.5, 0.25, 1e-3}}};
  {
    const std::unique_ptr<formats::ResultWriter> result =
        formats::open_result(formats::Kind::hdf5, path, {.binary = true});
    result->add_object("a", a);
    for (const double time : {0.0, 1.0, 2.0})
      result->add_frame(time, std::vector<formats::FrameObject>{{ua, none}});
    result->add_object("b", b);
    result->add_frame(3, std::vector<formats::FrameObject>{{ua, none}, {ub, forces}});
    result->commit();
  }
  for (std::size_t frame = 0; frame < 4; ++frame) {
    const formats::ResultSurface read = formats::read_result_surface(path, "b", frame);
    ASSERT_EQ(read.mesh.points.size(), read.rest.size());
    for (std::size_t i = 0; i < read.rest.size(); ++i) {
      const double by = frame < 3 ? 0 : 0.5;
      EXPECT_EQ(read.mesh.points[i], read.rest[i] + Vec3(by, by, by)) << frame;
    }
  }
  const formats::hdf5::File file = formats::hdf5::File::open(path);
  const formats::hdf5::Group group = file.root().group("objects").group("b").group("forces");
  EXPECT_EQ(group.read<std::uint64_t>("frame", 2), (std::vector<std::uint64_t>{3, 3}));
  std::vector<double> values(6);
  group.dataset("force", formats::hdf5::Number::float64).read_rows(0, std::span<double>(values));
  EXPECT_EQ(values, (std::vector<double>{1, 2, 3, -0.5, 0.25, 1e-3}));
}

TEST(Results, EqualRunsMakeEqualBytes) {
  const ScratchFolder folder, other;
  const model::Model a = textured(), b = test::two_masses();
  write(formats::Kind::hdf5, folder / "run.h5", a, b);
  write(formats::Kind::hdf5, other / "run.h5", a, b);
  for (const char* name : {"run.h5", "run.xdmf"}) {
    EXPECT_GT(bytes_of(folder / name).size(), 1000U);
    EXPECT_EQ(bytes_of(folder / name), bytes_of(other / name));
    EXPECT_EQ(bytes_of(folder / name).find(other / ""), std::string::npos); // no path
  }
  model::Model c = a;
  c.nodes[0].position.x += 1;
  write(formats::Kind::hdf5, other / "run.h5", c, b);
  EXPECT_NE(bytes_of(folder / "run.h5"), bytes_of(other / "run.h5"));
}

TEST(Results, TheXdmfNamesTheFileBesideIt) {
  const ScratchFolder folder;
  const model::Model a = textured(), b = test::two_masses();
  write(formats::Kind::hdf5, folder / "a & b.out.h5", a, b);
  const std::string text = bytes_of(folder / "a & b.out.xdmf");
  EXPECT_NE(text.find(">a &amp; b.out.h5:/objects/z-a/triangles<"), std::string::npos);
  EXPECT_EQ(text.find('/' + std::string("tmp")), std::string::npos);
  write(formats::Kind::hdf5, folder / "plain", a, b);
  EXPECT_NE(bytes_of(folder / "plain.xdmf").find(">plain:/objects/"), std::string::npos);
}

TEST(Results, NothingAppearsWithoutCommit) {
  const ScratchFolder folder;
  for (const formats::Kind kind : formats::result_kinds()) {
    const std::unique_ptr<formats::ResultWriter> result =
        formats::open_result(kind, folder / "r", {});
    const model::Model model = textured();
    result->add_object("a", model);
    const std::vector<double> u(3 * model.nodes.size());
    result->add_frame(0, std::vector<formats::FrameObject>{{u, {}}});
  }
  EXPECT_EQ(folder.files(), 0U);
  EXPECT_THROW((void)formats::open_result(formats::Kind::hdf5, "/dev/null", {}), Error);
  EXPECT_THROW((void)formats::open_result(formats::Kind::hdf5, "-", {.binary = false}), Error);
}

TEST(Results, ShapesOfSeveralObjectsBecomeParts) {
  const ScratchFolder folder;
  const model::Model a = textured(), b = test::organ(1);
  write(formats::Kind::ply, folder / "r.ply", a, b);
  const TriangleMesh mesh = formats::read_ply(bytes_of(folder / "r.ply"), "r.ply");
  const TriangleMesh surface = model::surface_mesh(a);
  EXPECT_EQ(mesh.points.size(), 2 * surface.points.size());
  EXPECT_EQ(mesh.triangles.size(), 2 * surface.triangles.size());
  EXPECT_EQ(mesh.part.front(), 0);
  EXPECT_EQ(mesh.part.back(), 1);
  EXPECT_EQ(mesh.texcoords.front(), surface.texcoords.front());
  EXPECT_EQ(mesh.points[1], surface.points[1] + Vec3(3.0 / 8, 4.0 / 8, 5.0 / 8));
  EXPECT_EQ(mesh.points[surface.points.size()], surface.points[0] - Vec3(0, 1.0 / 8, 2.0 / 8));
  write(formats::Kind::obj, folder / "r.obj", a, b);
  EXPECT_NE(bytes_of(folder / "r.obj").find("\no part1\n"), std::string::npos);
}

TEST(Results, ForcesAsCsv) {
  const ScratchFolder folder;
  const model::Model a = textured(), b = test::organ(1);
  write(formats::Kind::csv, folder / "r.csv", a, b, formats::TableRows::node);
  EXPECT_EQ(bytes_of(folder / "r.csv"), "time,object,node,fx,fy,fz\n"
                                        "0.1,z-a,3,1,2,3\n"
                                        "0.1,z-a,7,-0.5,0,0.001\n"
                                        "1,b,3,1,2,3\n"
                                        "1,b,7,-0.5,0,0.001\n");
}

TEST(Results, FramesAsCsvGetColumnsAsTheyCome) {
  const ScratchFolder folder;
  write(formats::Kind::csv, folder / "r.csv", textured(), test::organ(1));
  const std::string force = text::number_text(norm(Vec3(0.5, 2, 3.001)));
  EXPECT_EQ(bytes_of(folder / "r.csv"),
            "time [s],z-a.node_force_x [uN],z-a.node_force_y [uN],z-a.node_force_z [uN],"
            "z-a.node_force [uN],z-a.force_nodes,b.node_force_x [uN],b.node_force_y [uN],"
            "b.node_force_z [uN],b.node_force [uN],b.force_nodes\n"
            "0,0,0,0,0,0,,,,,\n"
            "0.1,0.5,2,3.001," +
                force + ",2,0,0,0,0,0\n1,0,0,0,0,0,0.5,2,3.001," + force + ",2\n");
}

TEST(Results, DepthCountsFromTheLastFrameWithoutATouch) {
  const ScratchFolder folder;
  const std::string path = folder / "r.csv";
  {
    const std::unique_ptr<formats::ResultWriter> result =
        formats::open_result(formats::Kind::csv, path, formats::Output::Options{.binary = false});
    formats::FrameInstrument probe{"p", true, {.radius = 2, .axis = {}}, {}, {}, {0, 3, 4}, {}, 0};
    const auto add = [&](double z, std::uint64_t touched) {
      probe.pose.place = {0, 0, z};
      probe.nodes = touched;
      result->set_instruments(std::vector<formats::FrameInstrument>{probe});
      result->add_frame(z, {});
    };
    add(9, 0);
    add(8, 0);
    add(6, 2);
    add(5, 1);
    add(4, 0);
    add(4, 1);
    result->set_attachments(std::vector<formats::FrameAttachment>{{"a", "b", 2, {0, 0, 5}}});
    result->add_frame(3, {});
    result->commit();
  }
  const formats::NumberTable table = formats::read_number_table(bytes_of(path), path);
  const std::vector<double>& depth = formats::find_column(table, "depth").values;
  ASSERT_EQ(depth.size(), 7U);
  EXPECT_EQ(std::vector<double>(depth.begin(), depth.end() - 1),
            (std::vector<double>{0, 0, 2, 3, 0, 0}));
  EXPECT_TRUE(std::isnan(depth.back())); // the instrument has gone
  EXPECT_EQ(formats::find_column(table, "p.force [uN]").values[0], 5);
  EXPECT_EQ(formats::find_column(table, "a+b.attach_force").values[6], 5);
  EXPECT_TRUE(std::isnan(formats::find_column(table, "a+b.springs").values[0]));
}

TEST(Results, EstimatesAreKeptOverTime) {
  const ScratchFolder folder;
  const std::string path = folder / "run.h5", curves = folder / "run.csv";
  const model::Model model = test::organ(1);
  const std::vector<double> u(3 * model.nodes.size());
  const std::optional<fem::DiscretisationError> none,
      some = fem::DiscretisationError{0.5, 7, 0.25, 90};
  for (const formats::Kind kind : {formats::Kind::hdf5, formats::Kind::csv}) {
    const std::unique_ptr<formats::ResultWriter> result =
        formats::open_result(kind, kind == formats::Kind::csv ? curves : path,
                             formats::Output::Options{.binary = formats::is_binary(kind)});
    result->add_object("o", model);
    formats::FrameObject object{u, {}};
    result->add_frame(0, std::span(&object, 1));
    object.estimate = &none;
    result->add_frame(1, std::span(&object, 1));
    object.estimate = &some;
    result->add_frame(2, std::span(&object, 1));
    result->commit();
  }
  const formats::hdf5::File file = formats::hdf5::File::open(path);
  const formats::hdf5::Group group = file.root().group("objects").group("o").group("estimates");
  EXPECT_EQ(group.number<std::uint64_t>("first_frame"), 1U);
  std::vector<double> stress(2);
  group.dataset("stress", formats::hdf5::Number::float64).read_rows(0, std::span<double>(stress));
  EXPECT_TRUE(std::isnan(stress[0]));
  EXPECT_EQ(stress[1], 90);
  const formats::NumberTable table = formats::read_number_table(bytes_of(curves), curves);
  EXPECT_EQ(formats::find_column(table, "estimate_relative").values[2], 0.5);
  EXPECT_TRUE(std::isnan(formats::find_column(table, "estimate_relative").values[1]));
  EXPECT_EQ(formats::find_column(table, "o.estimate_displacement [mm]").values[2], 0.25);
}

TEST(Results, ReadingNamesWhatIsMissing) {
  const ScratchFolder folder;
  const std::string path = folder / "run.h5";
  write(formats::Kind::hdf5, path, textured(), test::two_masses());
  const auto of = [&](const std::string& object, std::size_t frame) {
    return test::complaint([&] { (void)formats::read_result_surface(path, object, frame); });
  };
  EXPECT_EQ(of("b", 2), "");
  EXPECT_EQ(of("c", 0), path + ": there is no object 'c', expected one of z-a, b");
  EXPECT_EQ(of("b", 3), path + ": there is no frame 3, expected 0 to 2");
  EXPECT_NE(of("..", 0), "");
  EXPECT_NE(test::complaint([&] { (void)formats::read_result_index(folder / "none.h5"); }), "");
  {
    formats::hdf5::File other = formats::hdf5::File::create(folder / "other.h5");
    other.root().set("format", "stiffness_store");
    other.close();
    formats::hdf5::File newer = formats::hdf5::File::create(folder / "newer.h5");
    newer.root().set("format", "gewebe_results");
    newer.root().set("version", std::uint32_t{2});
    newer.close();
  }
  EXPECT_EQ(test::complaint([&] { (void)formats::read_result_index(folder / "other.h5"); }),
            (folder / "other.h5") + ": holds no results, expected a file that ffe-run made");
  EXPECT_EQ(test::complaint([&] { (void)formats::read_result_index(folder / "newer.h5"); }),
            (folder / "newer.h5") + ": is of version 2, expected 1");
}

TEST(Results, CutAndDamagedFilesAreErrors) {
  const ScratchFolder folder;
  const std::string path = folder / "run.h5", copy = folder / "copy.h5";
  write(formats::Kind::hdf5, path, test::two_masses(), test::two_masses());
  const std::string whole = bytes_of(path);
  for (std::size_t size = 0; size < whole.size(); size += 1 + size / 16) {
    std::ofstream(copy, std::ios::binary) << whole.substr(0, size);
    EXPECT_NE(test::complaint([&] { (void)formats::read_result_index(copy); }), "") << size;
  }
  // A byte changed anywhere: an error, or a result whose mesh is sound.
  std::size_t errors = 0;
  for (std::size_t at = 0; at < whole.size(); at += 1 + whole.size() / 200) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x15);
    std::ofstream(copy, std::ios::binary) << changed;
    errors += test::complaint([&] {
                for (const std::string& object : formats::read_result_index(copy).objects)
                  check_mesh(formats::read_result_surface(copy, object, 1).mesh);
              }).empty()
                  ? 0
                  : 1;
  }
  EXPECT_GT(errors, 0U);
}

/// The frames that change_object and add_part leave: 0 and 1 whole, 2 cut, 3 cut once more and with
/// a part beside it.
struct CutRun {
  model::Model whole = textured(), cut = whole, again = whole, part = test::organ(1);
  CutRun() {
    const auto copy = [](model::Model& model,
                         std::uint32_t from) { // behind the surface, at one corner
      const auto at = static_cast<std::uint32_t>(model::surface_count(model));
      model.nodes.insert(model.nodes.begin() + at, model.nodes[from]);
      for (model::Node& node : model.nodes)
        node.central += node.central >= 0 ? 1 : 0;
      for (Triangle& t : model.triangles)
        if (const auto corner = std::find(t.begin(), t.end(), from); corner != t.end()) {
          *corner = at;
          return;
        }
    };
    copy(cut, 5);
    again = cut;
    copy(again, 7);
  }
  std::vector<double> displaced(const model::Model& model, double by) const {
    return std::vector<double>(3 * model.nodes.size(), by);
  }
  std::vector<std::uint32_t> origin(const model::Model& model) const {
    std::vector<std::uint32_t> from(model.nodes.size());
    const std::size_t surface = model::surface_count(whole),
                      copies = model::surface_count(model) - surface;
    for (std::size_t i = 0; i < from.size(); ++i)
      from[i] = static_cast<std::uint32_t>(i < surface            ? i
                                           : i < surface + copies ? (i == surface ? 5 : 7)
                                                                  : i - copies);
    return from;
  }
  void write(formats::Kind kind, const std::string& path) const {
    const std::unique_ptr<formats::ResultWriter> result = formats::open_result(
        kind, path, formats::Output::Options{.binary = formats::is_binary(kind)});
    const std::vector<contact::NodeVector> none;
    const auto frame = [&](double time, const model::Model& model, double by,
                           bool with_part = false) {
      const std::vector<double> u = displaced(model, by), v = displaced(part, -by);
      std::vector<formats::FrameObject> objects{{u, none}};
      if (with_part)
        objects.push_back({v, none});
      result->add_frame(time, objects);
    };
    result->add_object("o", whole);
    frame(0, whole, 0);
    frame(1, whole, 1);
    {
      const model::Model passing = cut; // it may go
      result->change_object(0, passing, origin(passing));
    }
    frame(2, cut, 2);
    result->change_object(0, again, origin(again));
    result->add_part("o.1", part);
    frame(3, again, 3, true);
    frame(4, again, 4, true);
    result->commit();
  }
};

TEST(Results, ShapesThatCutsChangeAreReadAsTheyWere) {
  const ScratchFolder folder;
  const CutRun run;
  const std::string path = folder / "run.h5";
  run.write(formats::Kind::hdf5, path);
  EXPECT_EQ(formats::read_result_index(path).objects, (std::vector<std::string>{"o", "o.1"}));
  const model::Model* const models[] = {&run.whole, &run.whole, &run.cut, &run.again, &run.again};
  for (std::size_t frame = 0; frame < 5; ++frame) {
    const TriangleMesh surface = model::surface_mesh(*models[frame]);
    const formats::ResultSurface read = formats::read_result_surface(path, "o", frame);
    const auto by = static_cast<double>(frame);
    EXPECT_TRUE(read.there);
    EXPECT_EQ(read.mesh.triangles, surface.triangles) << frame;
    EXPECT_EQ(read.mesh.texcoords, surface.texcoords) << frame;
    EXPECT_EQ(read.rest, surface.points) << frame;
    ASSERT_EQ(read.mesh.points.size(), surface.points.size()) << frame;
    EXPECT_EQ(read.mesh.points.back(), surface.points.back() + Vec3(by, by, by)) << frame;
    EXPECT_EQ(formats::read_result_surface(path, "o.1", frame).there, frame >= 3) << frame;
  }
  EXPECT_EQ(formats::read_result_surface(path, "o.1", 4).mesh.points[0],
            run.part.nodes[0].position - Vec3(4, 4, 4));
  EXPECT_EQ(test::complaint([&] { (void)formats::read_result_surface(path, "o", 5); }),
            path + ": there is no frame 5, expected 0 to 4");
  const formats::hdf5::File file = formats::hdf5::File::open(path);
  const formats::hdf5::Group cuts = file.root().group("objects").group("o").group("cuts");
  EXPECT_EQ(cuts.groups(), (std::vector<std::string>{"1", "2"}));
  EXPECT_EQ(cuts.group("2").read<std::uint32_t>("origin", run.again.nodes.size()),
            run.origin(run.again));
}

/// What stands between two texts, from `at` on, which goes behind it; empty if they don't follow.
std::string between(const std::string& text, const std::string& open, const std::string& close,
                    std::size_t& at) {
  const std::size_t begin = text.find(open, at), end = text.find(close, begin + open.size());
  if (begin == std::string::npos || end == std::string::npos)
    return {};
  at = end;
  return text.substr(begin + open.size(), end - begin - open.size());
}

// Row, size and place of each frame's displacements name the numbers of that frame.
TEST(Results, TheXdmfOfACutObjectNamesTheRowsOfEachFrame) {
  const ScratchFolder folder;
  const CutRun run;
  run.write(formats::Kind::hdf5, folder / "run.h5");
  const formats::hdf5::File file = formats::hdf5::File::open(folder / "run.h5");
  const std::string text = bytes_of(folder / "run.xdmf");
  std::vector<std::pair<std::string, double>> told; // object, its displacement
  std::size_t at = 0;
  for (std::string slab;
       !(slab = between(text, "Dimensions=\"3 3\">", "</DataItem>", at)).empty();) {
    std::istringstream numbers(slab);
    std::uint64_t row = 0, n = 0;
    std::array<std::uint64_t, 8> rest{};
    numbers >> row;
    for (std::uint64_t& number : rest)
      numbers >> number;
    n = rest[6];
    EXPECT_EQ(rest, (std::array<std::uint64_t, 8>{0, 0, 1, 1, 1, 1, n, 3})) << slab;
    std::istringstream shape(between(text, "Dimensions=\"", "\"", at));
    std::vector<std::uint64_t> dimensions{std::istream_iterator<std::uint64_t>(shape), {}};
    const std::string path = between(text, ":/objects/", "/displacement<", at);
    formats::hdf5::Group group = file.root().group("objects");
    std::istringstream parts(path);
    for (std::string part; std::getline(parts, part, '/');)
      group = group.group(part);
    const formats::hdf5::Dataset set =
        group.dataset("displacement", formats::hdf5::Number::float32);
    ASSERT_NO_THROW(set.require_shape(dimensions)) << path;
    ASSERT_EQ(dimensions[1], n);
    ASSERT_LT(row, dimensions[0]);
    std::vector<float> values(3 * n);
    set.read_rows(row, std::span<float>(values));
    EXPECT_EQ(values.front(), values.back());
    told.emplace_back(path.substr(0, path.find('/')), static_cast<double>(values.front()));
  }
  EXPECT_EQ(told, (std::vector<std::pair<std::string, double>>{
                      {"o", 0}, {"o", 1}, {"o", 2}, {"o", 3}, {"o.1", -3}, {"o", 4}, {"o.1", -4}}));
}

/// A box of 12 tetrahedra of two materials.
model::Model solid_box(bool quadratic) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(2, 1, 1, 5);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    mesh.material.push_back(t >= 6 ? 1 : 0);
  fem::SolidModelOptions options;
  options.material = {{{.name = "gel", .poisson = 0.4}, {.name = "stone", .poisson = 0.2}}, {0, 1}};
  options.quadratic = quadratic;
  return fem::solid_model(std::move(mesh), options, {});
}

TEST(Results, SolidsAreWrittenAndRead) {
  const ScratchFolder folder;
  for (const bool quadratic : {false, true}) {
    const model::Model solid = solid_box(quadratic), springs = test::two_masses();
    const std::string path = folder / (quadratic ? "ten.h5" : "four.h5");
    write(formats::Kind::hdf5, path, solid, springs);
    const formats::ResultSolid read = formats::read_result_solid(path, "z-a", 1);
    const tetrahedra::TetMesh at_rest = fem::element_mesh(solid);
    EXPECT_TRUE(read.there);
    EXPECT_EQ(read.mesh.tetrahedra, at_rest.tetrahedra);
    EXPECT_EQ(read.mesh.middles, at_rest.middles);
    EXPECT_EQ(read.mesh.middles.empty(), !quadratic);
    EXPECT_EQ(read.mesh.material, at_rest.material);
    EXPECT_EQ(read.rest, at_rest.points);
    EXPECT_EQ(read.materials, (std::vector<std::string>{"gel", "stone"}));
    ASSERT_EQ(read.mesh.points.size(), at_rest.points.size());
    for (std::size_t i = 0; i < at_rest.points.size(); ++i) {
      const double k = 3 * static_cast<double>(i);
      EXPECT_EQ(read.mesh.points[i], at_rest.points[i] + Vec3(k / 8, (k + 1) / 8, (k + 2) / 8));
    }
    EXPECT_EQ(formats::read_result_solid(path, "z-a", 0).mesh.points, at_rest.points);
    EXPECT_EQ(test::complaint([&] { (void)formats::read_result_solid(path, "b", 1); }),
              path + ": object 'b' has no tetrahedra, expected a solid of them");
    EXPECT_EQ(test::complaint([&] { (void)formats::read_result_solid(path, "z-a", 3); }),
              path + ": there is no frame 3, expected 0 to 2");
    EXPECT_EQ(test::complaint([&] { (void)formats::read_result_solid(path, "none", 1); }),
              path + ": there is no object 'none', expected one of z-a, b");
    const std::string xdmf = bytes_of(folder / (quadratic ? "ten.xdmf" : "four.xdmf"));
    const std::string topology = "<Topology TopologyType=\"";
    EXPECT_NE(xdmf.find(topology + (quadratic ? "Tetrahedron_10\"" : "Tetrahedron\"") +
                        " NumberOfElements=\"12\">\n<DataItem Format=\"HDF\" Dimensions=\"12 " +
                        (quadratic ? "10" : "4")),
              std::string::npos)
        << xdmf;
    EXPECT_EQ(xdmf.find(topology + "Triangle"), std::string::npos);
  }
}

TEST(Results, FieldsBeginWhereTheyAreAskedFor) {
  const ScratchFolder folder;
  const std::string path = folder / "run.h5";
  const model::Model solid = solid_box(true);
  const std::size_t n = solid.nodes.size(), m = solid.tetrahedra.size();
  const std::vector<double> u(3 * n, 0.5);
  fem::SolidFields fields{
      std::vector<linalg::SymmetricBlock>(m), std::vector<linalg::SymmetricBlock>(n),
      std::vector<linalg::SymmetricBlock>(m), std::vector<linalg::SymmetricBlock>(n)};
  {
    const std::unique_ptr<formats::ResultWriter> result =
        formats::open_result(formats::Kind::hdf5, path, {.binary = true});
    result->add_object("o", solid);
    result->add_frame(0, std::vector<formats::FrameObject>{{u, {}}});
    for (const double factor : {1.0, 2.0}) {
      for (std::size_t i = 0; i < n; ++i) {
        fields.node_stress[i] = {factor * static_cast<double>(i), 0, 0, 0, 0, 0};
        fields.node_strain[i] = {0, 0, 0, 0, factor, 0};
      }
      for (std::size_t t = 0; t < m; ++t)
        fields.element_stress[t] = {0, 0, 0, 0, 0, -factor * static_cast<double>(t)};
      result->add_frame(factor, std::vector<formats::FrameObject>{{u, {}, &fields}});
    }
    result->commit();
  }
  for (const std::size_t frame : {1U, 2U}) {
    const std::vector<double> values = formats::read_result_values(path, "o", frame, "von-mises");
    ASSERT_EQ(values.size(), n);
    for (std::size_t i = 0; i < n; ++i)
      EXPECT_EQ(values[i], static_cast<double>(frame * i));
  }
  EXPECT_EQ(test::complaint([&] { (void)formats::read_result_values(path, "o", 0, "von-mises"); }),
            path + ": object 'o' has no stress in frame 0, expected a scene with 'emit stress o' "
                   "before it");
  EXPECT_EQ(test::complaint([&] { (void)formats::read_result_values(path, "o", 3, "von-mises"); }),
            path + ": there is no frame 3, expected 1 to 2");
  EXPECT_EQ(formats::read_result_values(path, "o", 0, "displacement"),
            std::vector<double>(n, norm(Vec3{0.5, 0.5, 0.5})));
  const formats::hdf5::File file = formats::hdf5::File::open(path);
  const formats::hdf5::Group group = file.root().group("objects").group("o").group("fields");
  EXPECT_EQ(group.number<std::uint64_t>("first_frame"), 1U);
  const auto row = [&](const char* name, std::size_t count) {
    std::vector<float> values(count);
    group.dataset(name, formats::hdf5::Number::float32).read_rows(1, std::span<float>(values));
    return values;
  };
  EXPECT_EQ(row("stress", 6 * n)[6 * 3], 6);
  EXPECT_EQ(row("strain", 6 * n)[6 * 3 + 4], 2);
  EXPECT_EQ(row("element_stress", 6 * m)[6 * 5 + 5], -10);
  EXPECT_EQ(row("element_von_mises", m)[5], 10);
  const std::string xdmf = bytes_of(folder / "run.xdmf");
  EXPECT_EQ(xdmf.find("Name=\"stress\""), xdmf.find("Name=\"stress\"", xdmf.find("Value=\"1\"")));
  // The object is alone: each array of a frame is a dataset.
  EXPECT_EQ(xdmf.find("HyperSlab"), std::string::npos);
  EXPECT_NE(
      xdmf.find("\"" + std::to_string(n) +
                " 6\" NumberType=\"Float\" Precision=\"4\">run.h5:/objects/o/frames/stress_1<"),
      std::string::npos);
}

/// A file by hand, of a solid with one tetrahedron.
struct HandMade {
  std::vector<std::uint32_t> tetrahedra{0, 1, 2, 3};
  formats::hdf5::Shape shape{1, 4};
  std::vector<std::int32_t> material{0};

  void write(const std::string& path) const {
    formats::hdf5::File file = formats::hdf5::File::create(path);
    file.root().set("format", "gewebe_results");
    file.root().set("version", std::uint32_t{1});
    file.root().write("time", std::vector<double>{0});
    formats::hdf5::Group objects = file.root().create_group("objects");
    formats::hdf5::Group o = objects.create_group("o");
    o.set("order", std::uint32_t{0});
    o.set("surface_nodes", std::uint64_t{4});
    const std::vector<double> points{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    o.write("points", std::span<const double>(points), {4, 3});
    const std::vector<std::uint32_t> faces{0, 2, 1};
    o.write("triangles", std::span<const std::uint32_t>(faces), {1, 3});
    const std::vector<float> u(12);
    o.write("displacement", std::span<const float>(u), {1, 4, 3});
    o.write("tetrahedra", std::span<const std::uint32_t>(tetrahedra), shape);
    o.write("tetrahedron_material", material);
    file.close();
  }
};

TEST(Results, TetrahedraThatAreWrongAreNamed) {
  const ScratchFolder folder;
  const std::string path = folder / "hand.h5";
  const auto of = [&](const HandMade& made) {
    made.write(path);
    return test::complaint([&] { (void)formats::read_result_solid(path, "o", 0); });
  };
  const std::vector<std::uint32_t> ten{0, 1, 2, 3, 0, 0, 0, 0, 0, 4};
  EXPECT_EQ(of({}), "");
  EXPECT_EQ(of({.tetrahedra = {0, 1, 2, 4}}),
            path + ": tetrahedron 0 has corner 4, expected an index below 4");
  EXPECT_EQ(of({.tetrahedra = ten, .shape = {1, 10}}),
            path + ": tetrahedron 0 has an edge's middle 4, expected an index below 4");
  EXPECT_EQ(of({.tetrahedra = {0, 1, 2}, .shape = {1, 3}}),
            path + ": '/objects/o/tetrahedra': has another shape, expected rows of 4 or of 10 "
                   "numbers");
  EXPECT_EQ(of({.shape = {4}}),
            path + ": '/objects/o/tetrahedra': has another shape, expected rows of 4 or of 10 "
                   "numbers");
  EXPECT_NE(of({.material = {0, 0}}).find("'/objects/o/tetrahedron_material': "),
            std::string::npos);
  EXPECT_EQ(of({.material = {-1}}), path + ": tetrahedron 0 has material -1, expected 0 or more");
}

TEST(Results, DamagedSolidsAreErrorsOrSound) {
  const ScratchFolder folder;
  const std::string path = folder / "run.h5", copy = folder / "copy.h5";
  write(formats::Kind::hdf5, path, solid_box(true), test::two_masses());
  const std::string whole = bytes_of(path);
  std::size_t errors = 0;
  for (std::size_t at = 0; at < whole.size(); at += 1 + whole.size() / 400) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x15);
    std::ofstream(copy, std::ios::binary) << changed;
    errors += test::complaint([&] {
                tetrahedra::check_mesh(formats::read_result_solid(copy, "z-a", 1).mesh);
              }).empty()
                  ? 0
                  : 1;
  }
  EXPECT_GT(errors, 0U);
}

TEST(Results, ACutThatKeepsTheNodesHasThemInTheirPlaces) {
  const ScratchFolder folder;
  const std::string path = folder / "run.h5";
  const model::Model whole = textured();
  model::Model cut = whole; // springs alone
  cut.springs.resize(cut.springs.size() / 2);
  {
    const std::vector<double> u(3 * whole.nodes.size());
    const std::unique_ptr<formats::ResultWriter> result =
        formats::open_result(formats::Kind::hdf5, path, {.binary = true});
    result->add_object("o", whole);
    result->add_frame(0, std::vector<formats::FrameObject>{{u, {}}});
    result->change_object(0, cut, {});
    result->add_frame(1, std::vector<formats::FrameObject>{{u, {}}});
    result->commit();
  }
  const formats::hdf5::File file = formats::hdf5::File::open(path);
  const formats::hdf5::Group group =
      file.root().group("objects").group("o").group("cuts").group("1");
  const auto origin = group.read<std::uint32_t>("origin", cut.nodes.size());
  for (std::uint32_t i = 0; i < origin.size(); ++i)
    EXPECT_EQ(origin[i], i);
}

TEST(Results, EachShapeOfASeriesHasItsOwnTriangles) {
  const ScratchFolder folder;
  const CutRun run;
  run.write(formats::Kind::ply, folder / "r%d.ply");
  EXPECT_EQ(formats::read_ply(bytes_of(folder / "r1.ply"), "").triangles, run.whole.triangles);
  EXPECT_EQ(formats::read_ply(bytes_of(folder / "r2.ply"), "").triangles, run.cut.triangles);
  const TriangleMesh last = formats::read_ply(bytes_of(folder / "r4.ply"), "");
  EXPECT_EQ(last.triangles.size(), run.again.triangles.size() + run.part.triangles.size());
  EXPECT_EQ(last.part.back(), 1);
  run.write(formats::Kind::obj, folder / "last.obj");
  run.write(formats::Kind::csv, folder / "f.csv");
}

TEST(Results, DamagedCutsAreErrors) {
  const ScratchFolder folder;
  const CutRun run;
  const std::string path = folder / "run.h5", copy = folder / "copy.h5";
  run.write(formats::Kind::hdf5, path);
  const std::string whole = bytes_of(path);
  std::size_t errors = 0;
  for (std::size_t at = 0; at < whole.size(); at += 1 + whole.size() / 300) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x15);
    std::ofstream(copy, std::ios::binary) << changed;
    errors += test::complaint([&] {
                for (const std::string& object : formats::read_result_index(copy).objects)
                  for (std::size_t frame = 0; frame < 5; ++frame)
                    check_mesh(formats::read_result_surface(copy, object, frame).mesh);
              }).empty()
                  ? 0
                  : 1;
  }
  EXPECT_GT(errors, 0U);
}

TEST(Results, NumbersThatDoNotFitSinglePrecision) {
  const ScratchFolder folder;
  const model::Model model = test::two_masses();
  const std::unique_ptr<formats::ResultWriter> result =
      formats::open_result(formats::Kind::hdf5, folder / "r.h5", {});
  result->add_object("a", model);
  const std::vector<double> u{0, 0, 1e39, 0, 0, 0};
  EXPECT_NE(test::complaint([&] {
              result->add_frame(0, std::vector<formats::FrameObject>{{u, {}}});
            }).find("does not fit single precision"),
            std::string::npos);
}

} // namespace
} // namespace gewebe::test
