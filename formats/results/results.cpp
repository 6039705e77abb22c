#include "formats/results/results.h"

#include "base/error.h"
#include "embedding/skin.h"
#include "formats/results/result_groups_internal.h"
#include "formats/store/hdf5_internal.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace gewebe::formats {

namespace {

hdf5::File open_checked(const std::string& path) {
  hdf5::File file = hdf5::File::open(path);
  const hdf5::Group& root = file.root();
  if (!root.has_attribute("format") || root.text("format") != "gewebe_results")
    throw Error(path, "holds no results, expected a file that ffe-run made");
  const auto version = root.number<std::uint32_t>("version");
  if (version != 1)
    throw Error(path, "is of version " + std::to_string(version) + ", expected 1");
  return file;
}

/// Rows of an array n × 3.
std::uint64_t rows_of_three(const hdf5::Dataset& dataset) {
  if (dataset.shape().size() != 2 || dataset.shape()[1] != 3)
    dataset.fail("has another shape, expected rows of 3 numbers");
  return dataset.rows();
}

/// The group that holds the shape of an object in a frame, and the first frame that it holds.
struct ShapeGroup {
  hdf5::Group group;
  std::uint64_t first = 0;
};

/// Nothing where the object comes later.
std::optional<ShapeGroup> shape_in_frame(const hdf5::Group& objects, const std::string& name,
                                         std::uint64_t frame) {
  ShapeGroup found{objects.group(name)};
  const hdf5::Group object = objects.group(name);
  if (object.has_attribute("first_frame"))
    found.first = object.number<std::uint64_t>("first_frame");
  if (frame < found.first)
    return std::nullopt;
  if (!object.has("cuts"))
    return found;
  const hdf5::Group cuts = object.group("cuts");
  for (std::uint64_t k = 1; cuts.has(std::to_string(k)); ++k) {
    hdf5::Group cut = cuts.group(std::to_string(k));
    const auto first = cut.number<std::uint64_t>("first_frame");
    if (first < found.first)
      cut.fail("begins in frame " + std::to_string(first) + ", expected none before " +
               std::to_string(found.first));
    if (first > frame)
      break;
    found = {std::move(cut), first};
  }
  return found;
}

/// The group of an object. \throw Error naming those there are
hdf5::Group object_group(const std::string& path, const hdf5::Group& objects,
                         const std::string& object) {
  if (objects.has(object))
    return objects.group(object);
  std::string list;
  for (const std::string& name : ordered_names(objects))
    list += (list.empty() ? "" : ", ") + name;
  throw Error(path, "there is no object '" + object + "', expected " +
                        (list.empty() ? "one, but there is none" : "one of " + list));
}

/// How many of the nodes are on the surface.
std::uint64_t surface_nodes(const hdf5::Group& group, std::uint64_t nodes) {
  const auto count = group.number<std::uint64_t>("surface_nodes");
  if (count > nodes)
    group.fail("has " + std::to_string(count) + " nodes on the surface, expected at most " +
               std::to_string(nodes));
  return count;
}

/// The first `count` points of a shape in a frame, or all; at rest, and displaced.
struct FramePoints {
  std::vector<Vec3> rest, moved;
  std::vector<double> lengths; ///< of the displacements
};
FramePoints read_points(const std::string& path, const ShapeGroup& shape, std::size_t frame,
                        bool surface) {
  const hdf5::Group& group = shape.group;
  const hdf5::Dataset points = group.dataset("points", hdf5::Number::float64);
  const std::uint64_t n = rows_of_three(points), of_surface = surface_nodes(group, n);
  const hdf5::Dataset displacement = group.dataset("displacement", hdf5::Number::float32);
  displacement.require_shape({displacement.rows(), n, 3});
  if (frame - shape.first >= displacement.rows())
    throw Error(path, "there is no frame " + std::to_string(frame) + ", expected 0 to " +
                          std::to_string(shape.first + displacement.rows() - 1));
  std::vector<double> rest(3 * n);
  std::vector<float> moved(3 * n);
  points.read_rows(0, std::span<double>(rest));
  displacement.read_rows(frame - shape.first, std::span<float>(moved));
  FramePoints result;
  const std::uint64_t count = surface ? of_surface : n;
  result.rest.reserve(count);
  result.moved.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double* const p = &rest[3 * i];
    const float* const u = &moved[3 * i];
    result.rest.push_back({p[0], p[1], p[2]});
    result.lengths.push_back(
        norm({static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])}));
    result.moved.push_back({p[0] + static_cast<double>(u[0]), p[1] + static_cast<double>(u[1]),
                            p[2] + static_cast<double>(u[2])});
  }
  return result;
}

/// Triangles, with texture coordinates and materials where there are some.
void read_triangles(const hdf5::Group& group, TriangleMesh& mesh) {
  const hdf5::Dataset triangles = group.dataset("triangles", hdf5::Number::uint32);
  const std::uint64_t count = rows_of_three(triangles);
  std::vector<std::uint32_t> corners(3 * count);
  triangles.read_rows(0, std::span<std::uint32_t>(corners));
  mesh.triangles.reserve(count);
  for (std::size_t t = 0; t < count; ++t)
    mesh.triangles.push_back({corners[3 * t], corners[3 * t + 1], corners[3 * t + 2]});

  if (group.has("texcoords")) {
    const hdf5::Dataset texcoords = group.dataset("texcoords", hdf5::Number::float32);
    texcoords.require_shape({count, 3, 2});
    std::vector<float> st(6 * count);
    texcoords.read_rows(0, std::span<float>(st));
    mesh.texcoords.resize(count);
    for (std::size_t t = 0; t < count; ++t)
      std::copy_n(&st[6 * t], 6, mesh.texcoords[t].begin());
  }
  if (group.has("material"))
    mesh.material = group.read<std::int32_t>("material", count);
}

/// How a skin follows the nodes of a shape.
embedding::SkinWeights read_skin_weights(const hdf5::Group& group, std::size_t nodes) {
  const std::uint64_t count = rows_of_three(group.dataset("points", hdf5::Number::float64));
  const hdf5::Dataset followed = group.dataset("nodes", hdf5::Number::uint32),
                      weights = group.dataset("weights", hdf5::Number::float64);
  const std::uint64_t each = followed.shape().size() == 2 ? followed.shape()[1] : 0;
  followed.require_shape({count, each});
  weights.require_shape({count, each});
  embedding::SkinWeights skin;
  skin.nodes = each;
  skin.node.resize(each * count);
  followed.read_rows(0, std::span<std::uint32_t>(skin.node));
  skin.weight.resize(each * count);
  weights.read_rows(0, std::span<double>(skin.weight));
  for (const std::uint32_t node : skin.node)
    if (node >= nodes)
      followed.fail("names node " + std::to_string(node) + ", expected 0 to " +
                    std::to_string(nodes - 1));
  return skin;
}

/// The skin of a shape in a frame, from the displacements of its nodes.
void read_skin(const hdf5::Group& group, const FramePoints& nodes, ResultSurface& result) {
  const embedding::SkinWeights skin = read_skin_weights(group, nodes.rest.size());
  const hdf5::Dataset points = group.dataset("points", hdf5::Number::float64);
  const std::uint64_t count = points.rows();
  std::vector<double> rest(3 * count);
  points.read_rows(0, std::span<double>(rest));
  std::vector<double> displacement;
  displacement.reserve(3 * nodes.rest.size());
  for (std::size_t i = 0; i < nodes.rest.size(); ++i) {
    const Vec3 u = nodes.moved[i] - nodes.rest[i];
    displacement.insert(displacement.end(), {u.x, u.y, u.z});
  }
  for (std::size_t i = 0; i < count; ++i)
    result.rest.push_back({rest[3 * i], rest[3 * i + 1], rest[3 * i + 2]});
  result.mesh.points = embedding::displaced_skin(skin, result.rest, displacement);
  read_triangles(group, result.mesh);
}

std::vector<double> read_von_mises(const std::string& path, const ShapeGroup& shape,
                                   const std::string& object, std::size_t frame) {
  const std::uint64_t n = rows_of_three(shape.group.dataset("points", hdf5::Number::float64));
  const bool any = shape.group.has("fields");
  const auto first =
      any ? shape.group.group("fields").number<std::uint64_t>("first_frame") : std::uint64_t{0};
  if (!any || frame < first)
    throw Error(path, "object '" + object + "' has no stress in frame " + std::to_string(frame) +
                          ", expected a scene with 'emit stress " + object + "' before it");
  const hdf5::Dataset set = shape.group.group("fields").dataset("von_mises", hdf5::Number::float32);
  set.require_shape({set.rows(), n});
  if (frame - first >= set.rows())
    throw Error(path, "there is no frame " + std::to_string(frame) + ", expected " +
                          std::to_string(first) + " to " + std::to_string(first + set.rows() - 1));
  std::vector<float> values(n);
  set.read_rows(frame - first, std::span<float>(values));
  return {values.begin(), values.end()};
}

void require_finite(const std::string& path, const std::string& object, const std::string& field,
                    const std::vector<double>& values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      throw Error(path, "the " + field + " of node " + std::to_string(i) + " of object '" + object +
                            "' is not finite");
}

/// A row of `count` numbers. \throw Error if there is none, or one is larger than any scene has
template <std::size_t count>
std::array<double, count> read_row(const hdf5::Group& group, const char* name,
                                   const hdf5::Shape& shape, std::uint64_t row) {
  const hdf5::Dataset set = group.dataset(name, hdf5::Number::float64);
  hdf5::Shape whole{set.rows()};
  whole.insert(whole.end(), shape.begin(), shape.end());
  set.require_shape(whole);
  std::array<double, count> values{};
  set.read_rows(row, std::span<double>(values));
  for (const double value : values)
    if (!(std::fabs(value) <= 1e100))
      set.fail("holds a number that is beyond 1e100");
  return values;
}

bool is_rotation(const std::array<Vec3, 3>& rows) {
  const Vec3 &x = rows[0], &y = rows[1], &z = rows[2];
  return std::fabs(dot(x, x) - 1) < 1e-6 && std::fabs(dot(y, y) - 1) < 1e-6 &&
         std::fabs(dot(z, z) - 1) < 1e-6 && norm(cross(x, y) - z) < 1e-6;
}

/// The surface of a mesh in a frame, of those that it had one after the other.
TriangleMesh read_shown(const hdf5::Group& surfaces, std::uint64_t frame) {
  for (std::size_t k = 1; surfaces.has(std::to_string(k)); ++k) {
    const hdf5::Group group = surfaces.group(std::to_string(k));
    const auto first = group.number<std::uint64_t>("first_frame");
    const hdf5::Dataset places = group.dataset("points", hdf5::Number::float32);
    if (frame < first || frame - first >= places.rows())
      continue;
    TriangleMesh mesh;
    read_triangles(group, mesh);
    const hdf5::Dataset normals = group.dataset("normals", hdf5::Number::float32);
    const std::uint64_t count = normals.rows();
    normals.require_shape({count, 3});
    places.require_shape({places.rows(), count, 3});
    std::vector<float> place(3 * count);
    places.read_rows(frame - first, std::span<float>(place));
    mesh.normals.resize(count);
    normals.read_rows(0, std::span<float>(mesh.normals.data()->data(), 3 * count));
    for (std::size_t i = 0; i < count; ++i)
      mesh.points.push_back({place[3 * i], place[3 * i + 1], place[3 * i + 2]});
    check_mesh(mesh);
    return mesh;
  }
  surfaces.fail("has no surface in frame " + std::to_string(frame));
}

/// Nothing where it is not there in this row, or of a kind that is not known.
std::optional<ResultInstrument> read_instrument(const hdf5::Group& group, std::uint64_t row,
                                                std::uint64_t frame) {
  std::uint8_t kind = 0;
  group.dataset("kind", hdf5::Number::uint8).read_rows(row, std::span<std::uint8_t>(&kind, 1));
  if (kind == 0 || kind > static_cast<std::uint8_t>(contact::InstrumentKind::mesh))
    return std::nullopt;
  const auto vector = [&](const char* name) {
    const auto [x, y, z] = read_row<3>(group, name, {3}, row);
    return Vec3{x, y, z};
  };
  const auto ends = read_row<6>(group, "ends", {2, 3}, row);
  const auto pose = read_row<12>(group, "pose", {3, 4}, row);
  ResultInstrument read;
  read.kind = static_cast<contact::InstrumentKind>(kind);
  read.radius = read_row<1>(group, "radius", {}, row)[0];
  read.friction = read_row<1>(group, "friction", {}, row)[0];
  if (!(read.radius >= 0))
    group.fail("has a radius below 0");
  read.ends = {Vec3{ends[0], ends[1], ends[2]}, Vec3{ends[3], ends[4], ends[5]}};
  for (std::size_t a = 0; a < 3; ++a)
    read.rotation[a] = {pose[4 * a], pose[4 * a + 1], pose[4 * a + 2]};
  if (!is_rotation(read.rotation))
    group.fail("has a pose that is no rotation");
  read.place = {pose[3], pose[7], pose[11]};
  read.force = vector("force");
  read.torque = vector("torque");
  std::uint32_t touched = 0;
  group.dataset("touched", hdf5::Number::uint32)
      .read_rows(row, std::span<std::uint32_t>(&touched, 1));
  read.touched = touched;
  if (read.kind == contact::InstrumentKind::mesh)
    read.surface = read_shown(group.group("surfaces"), frame);
  return read;
}

} // namespace

ResultIndex read_result_index(const std::string& path) {
  const hdf5::File file = open_checked(path);
  const hdf5::Dataset time = file.root().dataset("time", hdf5::Number::float64);
  time.require_shape({time.rows()});
  ResultIndex index;
  index.times.resize(time.rows());
  time.read_rows(0, std::span<double>(index.times));
  index.objects = ordered_names(file.root().group("objects"));
  if (file.root().has("instruments"))
    index.instruments = ordered_names(file.root().group("instruments"));
  return index;
}

std::vector<ResultInstrument> read_result_instruments(const std::string& path, std::size_t frame) {
  const hdf5::File file = open_checked(path);
  const std::uint64_t frames = file.root().dataset("time", hdf5::Number::float64).rows();
  if (frame >= frames)
    throw Error(path, "there is no frame " + std::to_string(frame) + ", expected 0 to " +
                          std::to_string(frames - 1));
  std::vector<ResultInstrument> found;
  if (!file.root().has("instruments"))
    return found;
  const hdf5::Group all = file.root().group("instruments");
  for (const std::string& name : ordered_names(all)) {
    const hdf5::Group group = all.group(name);
    const auto first = group.number<std::uint64_t>("first_frame");
    if (frame < first)
      continue;
    if (std::optional<ResultInstrument> there = read_instrument(group, frame - first, frame)) {
      there->name = name;
      found.push_back(std::move(*there));
    }
  }
  return found;
}

ResultSurface read_result_surface(const std::string& path, const std::string& object,
                                  std::size_t frame, bool skin) {
  const hdf5::File file = open_checked(path);
  const hdf5::Group objects = file.root().group("objects");
  const hdf5::Group whole = object_group(path, objects, object);
  const std::optional<ShapeGroup> shape = shape_in_frame(objects, object, frame);
  if (!shape) {
    ResultSurface none;
    none.there = false;
    return none;
  }
  const hdf5::Group& group = shape->group;
  ResultSurface result;
  if (skin && group.has("skin")) {
    read_skin(group.group("skin"), read_points(path, *shape, frame, false), result);
  } else {
    FramePoints points = read_points(path, *shape, frame, true);
    result.rest = std::move(points.rest);
    result.mesh.points = std::move(points.moved);
    read_triangles(group, result.mesh);
  }
  if (whole.has("materials"))
    result.materials = whole.read_texts("materials");
  gewebe::at(path, [&] { check_mesh(result.mesh); });
  return result;
}

ResultSolid read_result_solid(const std::string& path, const std::string& object,
                              std::size_t frame) {
  const hdf5::File file = open_checked(path);
  const hdf5::Group objects = file.root().group("objects");
  const hdf5::Group whole = object_group(path, objects, object);
  ResultSolid result;
  const std::optional<ShapeGroup> shape = shape_in_frame(objects, object, frame);
  if (!shape) {
    result.there = false;
    return result;
  }
  const hdf5::Group& group = shape->group;
  if (!group.has("tetrahedra"))
    throw Error(path, "object '" + object + "' has no tetrahedra, expected a solid of them");
  FramePoints points = read_points(path, *shape, frame, false);
  result.rest = std::move(points.rest);
  tetrahedra::TetMesh& mesh = result.mesh;
  mesh.points = std::move(points.moved);
  const hdf5::Dataset tetrahedra = group.dataset("tetrahedra", hdf5::Number::uint32);
  const std::uint64_t count = tetrahedra.rows(),
                      nodes = tetrahedra.shape().size() == 2 ? tetrahedra.shape()[1] : 0;
  if (nodes != 4 && nodes != 10)
    tetrahedra.fail("has another shape, expected rows of 4 or of 10 numbers");
  std::vector<std::uint32_t> numbers(nodes * count);
  tetrahedra.read_rows(0, std::span<std::uint32_t>(numbers));
  mesh.tetrahedra.resize(count);
  mesh.middles.resize(nodes == 10 ? count : 0);
  for (std::size_t t = 0; t < count; ++t) {
    std::copy_n(&numbers[nodes * t], 4, mesh.tetrahedra[t].begin());
    if (nodes == 10)
      std::copy_n(&numbers[nodes * t + 4], 6, mesh.middles[t].begin());
  }
  mesh.material = group.read<std::int32_t>("tetrahedron_material", count);
  if (whole.has("materials"))
    result.materials = whole.read_texts("materials");
  gewebe::at(path, [&] { tetrahedra::check_mesh(mesh); });
  return result;
}

std::vector<double> read_result_surface_stress(const std::string& path, const std::string& object,
                                               std::size_t frame) {
  const hdf5::File file = open_checked(path);
  const hdf5::Group objects = file.root().group("objects");
  (void)object_group(path, objects, object);
  const std::optional<ShapeGroup> shape = shape_in_frame(objects, object, frame);
  if (!shape || !shape->group.has("fields") ||
      frame < shape->group.group("fields").number<std::uint64_t>("first_frame"))
    return {};
  std::vector<double> nodes = read_von_mises(path, *shape, object, frame);
  require_finite(path, object, "von-mises", nodes);
  if (!shape->group.has("skin")) {
    nodes.resize(surface_nodes(shape->group, nodes.size()));
    return nodes;
  }
  const embedding::SkinWeights skin = read_skin_weights(shape->group.group("skin"), nodes.size());
  std::vector<double> values;
  for (std::size_t first = 0; first < skin.node.size(); first += skin.nodes) {
    // Outside the element the weights extrapolate; stresses stay between those of its nodes.
    double value = 0, least = nodes[skin.node[first]], greatest = least;
    for (std::size_t k = first; k < first + skin.nodes; ++k) {
      const double node = nodes[skin.node[k]];
      value += skin.weight[k] * node;
      least = node < least ? node : least;
      greatest = node > greatest ? node : greatest;
    }
    values.push_back(value > greatest ? greatest : value >= least ? value : least);
  }
  return values;
}

const std::vector<std::string>& result_field_names() {
  static const std::vector<std::string> names{"displacement", "von-mises"};
  return names;
}

std::vector<double> read_result_values(const std::string& path, const std::string& object,
                                       std::size_t frame, const std::string& field) {
  const hdf5::File file = open_checked(path);
  const hdf5::Group objects = file.root().group("objects");
  (void)object_group(path, objects, object);
  const std::optional<ShapeGroup> shape = shape_in_frame(objects, object, frame);
  if (!shape)
    return {};
  std::vector<double> values = field == "von-mises"
                                   ? read_von_mises(path, *shape, object, frame)
                                   : read_points(path, *shape, frame, false).lengths;
  require_finite(path, object, field, values);
  return values;
}

} // namespace gewebe::formats
