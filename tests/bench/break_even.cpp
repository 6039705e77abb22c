// Hybrid scenes against elastodynamics alone (report FZKA 7190, section 4.3, figure 4-9): the
// organs of examples/cholecystectomy, and organs of $GEWEBE_SHARED/data where they are.
//
// A cycle is 1/60 s of simulated time with all shapes at its end: elastodynamic objects, kept
// moving, take the steps that are safe for them, elastostatic ones are evaluated once, and every
// contact's displacement is another one each cycle, none moving as its neighbour. Then the report's
// own count: a cycle is one integration step. Then such cycles that end with the forces of all
// contacts and no shape, as a hand feels them between two pictures. Last the same shape from both:
// time to within 1e-3 of the linearised equilibrium, in the elastodynamic method's favour the first
// time that it comes so near.
//
// One thread, and the time that its processor worked. Writes CSV to standard output: stage ("… over
// …": what stands in the third column), program, size, contacts, threads, median, fastest and
// slowest time in ms, a figure and its unit; and to standard error what follows from it.

#include "base/error.h"
#include "columns/column_compression.h"
#include "columns/compliance_columns.h"
#include "compliance/compliance_source.h"
#include "dynamics/solid_dynamic.h"
#include "fem/model_stiffness.h"
#include "formats/mesh/mesh_file.h"
#include "formats/model/ela.h"
#include "formats/store/stiffness_store_writer.h"
#include "linalg/condition.h"
#include "model/build.h"
#include "scene/simulation.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/random_cuts.h"
#include "tests/unit/scratch.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

using namespace gewebe;
using namespace gewebe::test;
using namespace gewebe::timing;

namespace {

constexpr double frame = 1.0 / 60;
constexpr std::size_t max_contacts = 200;

struct Organ {
  std::string name;
  model::Model model;
  bool still = false; // elastostatic in the hybrid scene
};
struct Scene {
  std::string name;
  std::vector<Organ> organs;
  std::size_t touched = 0;
};

void report(const std::string& stage, const std::string& program, double size, std::size_t contacts,
            const Times& times, double figure, const char* unit) {
  std::printf("%s,%s,%.6g,%zu,1,%.4f,%.4f,%.4f,%.6g,%s\n", stage.c_str(), program.c_str(), size,
              contacts, times.median, times.fastest, times.slowest, figure, unit);
  std::fflush(stdout);
}

// ---- organs

/// Made by the example's own Makefile, in a folder that goes again.
Scene example() {
  const std::string source = "examples/cholecystectomy";
  std::string folder = (std::filesystem::temp_directory_path() / "gewebe-bench-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr)
    throw Error(folder, "cannot be made");
  Scene scene{"made organs", {}, 0};
  const std::string tools = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
  const std::string make = "cp " + source + "/* '" + folder + "' 2>/dev/null; PATH='" + tools +
                           "':\"$PATH\" make -s -C '" + folder + "' models >/dev/null";
  if (std::system(make.c_str()) == 0)
    for (const char* const name : {"liver", "intestine", "arteries", "ducts", "gallbladder"}) {
      formats::Input input(folder + "/" + name + ".ela", false);
      scene.organs.push_back(
          {name, formats::read_ela(input, Context{}), std::string(name) != "gallbladder"});
    }
  std::filesystem::remove_all(folder);
  if (scene.organs.empty())
    throw Error(source, "its models can't be made");
  return scene;
}

model::Model organ_of(const std::string& path, const char* unit, std::int32_t part) {
  formats::Input input(path);
  const formats::Kind kind = formats::input_kind(input.peek(4096), path, "");
  TriangleMesh mesh = formats::read_mesh(input, {kind, unit, formats::weld_from_name("auto")});
  if (part >= 0) {
    std::vector<Triangle> kept;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      if (mesh.part.at(t) == part)
        kept.push_back(mesh.triangles[t]);
    TriangleMesh one;
    one.points = mesh.points;
    one.triangles = std::move(kept);
    mesh = std::move(one);
  }
  model::BuildOptions options;
  options.bend = true;
  return model::build_model(mesh, options, Context{}).model; // points of other parts are left out
}

Scene shared_organs() {
  const char* const shared = std::getenv("GEWEBE_SHARED");
  const std::string data = std::string(shared != nullptr ? shared : "../shared") + "/data/";
  struct File {
    const char *organ, *name, *unit;
    std::int32_t part;
    bool still;
  };
  const File files[] = {{"colon", "gca90_large_intestine_20k.stl", "mm", -1, true},
                        {"liver", "sofa_liver_smooth.obj", "cm", -1, true},
                        {"spleen", "hubmap_F_spleen_uv.obj", "m", -1, false},
                        {"gallbladder", "ts_liver_gallbladder_portal.obj", "mm", 1, false},
                        {"portal vein", "ts_liver_gallbladder_portal.obj", "mm", 2, false}};
  Scene scene{"shared organs", {}, 0};
  for (const File& file : files) {
    if (!std::filesystem::exists(data + file.name)) {
      (void)std::fprintf(stderr, "shared organs: skipped, no %s\n", file.name);
      return {};
    }
    scene.organs.push_back(
        {file.organ, organ_of(data + file.name, file.unit, file.part), file.still});
  }
  return scene;
}

double share(const Scene& scene, const std::vector<bool>& still) {
  double all = 0, some = 0;
  for (std::size_t i = 0; i < scene.organs.size(); ++i) {
    const auto nodes = static_cast<double>(scene.organs[i].model.nodes.size());
    all += nodes;
    some += still[i] ? nodes : 0;
  }
  return 100 * some / all;
}

/// Free nodes of the surface, the nearest to the first of them first.
std::vector<std::uint32_t> patch(const model::Model& model) {
  std::vector<std::uint32_t> nodes;
  const std::size_t surface = model::surface_count(model);
  for (std::uint32_t i = 0; i < surface; ++i)
    if (model.nodes[i].fixed == model::fixed_none)
      nodes.push_back(i);
  const Vec3 middle = model.nodes[nodes[nodes.size() / 2]].position;
  std::ranges::stable_sort(nodes, {}, [&](std::uint32_t i) {
    const Vec3 d = model.nodes[i].position - middle;
    return dot(d, d);
  });
  return nodes;
}

/// A store of one object, with columns of some nodes.
class Stored {
public:
  enum class Kept { float64, float32, compressed };
  Stored(const model::Model& model, std::vector<std::uint32_t> nodes, Kept kept) {
    std::ranges::sort(nodes);
    const Context context = with_threads(0);
    {
      formats::Output output(file_.path(), {});
      formats::StiffnessStoreWriter writer(output);
      const linalg::StiffnessMatrix matrix = fem::stiffness_matrix(model);
      linalg::StiffnessCheck check;
      const linalg::Factor factor = linalg::checked_factor(model, matrix, context, check);
      formats::StiffnessFacts facts;
      facts.object = "organ";
      facts.hash = formats::stiffness_hash(model);
      facts.rest = formats::rest_hash(model);
      facts.nodes = model.nodes.size();
      facts.order = matrix.order();
      facts.norm = check.norm;
      facts.condition = check.condition;
      facts.single = kept == Kept::float32;
      facts.compressed = kept == Kept::compressed ? 1e-6 : 0;
      const auto missing = writer.begin(facts, matrix, factor, nodes);
      const auto columns_of = [&](std::span<const std::uint32_t> some, columns::ColumnSink& sink) {
        return columns::compliance_columns(matrix, factor, check.norm, some, context, sink);
      };
      double residual = 0;
      if (kept == Kept::compressed) {
        std::vector<Vec3> positions;
        for (const model::Node& node : model.nodes)
          positions.push_back(node.position);
        const columns::CompressedMade made =
            columns::compress_columns(positions, nodes, facts.compressed, columns_of, context);
        writer.write_compressed(made);
        residual = made.residual;
      } else {
        residual = columns_of(missing, writer);
      }
      (void)writer.end(test::larger(check.residual, residual));
      writer.close();
      output.commit();
    }
    store_ = std::make_shared<formats::StiffnessStore>(file_.path());
    facts_ = store_->facts(model);
  }

  std::shared_ptr<compliance::ComplianceSource> compliance() const {
    return compliance::compliance_of_store(
        {store_->columns(facts_),
         [store = store_, facts = facts_] { return store->factor(facts); }});
  }

private:
  ScratchFile file_{".h5"};
  std::shared_ptr<formats::StiffnessStore> store_;
  formats::StiffnessFacts facts_;
};

// ---- cycles

struct Variant {
  const char* name = "";
  const Stored* store = nullptr;
  double tolerance = 0;
};

/// Simulated time, and what stands at its end: all shapes, or forces of contacts alone.
struct Cycle {
  double duration = 0;
  bool shapes = true;
  int burst = 1; ///< so many in a row are measured
  const char* name = "";
};

/// The scene; organs with `left_out` are not in it at all.
class Running {
public:
  Running(const Scene& scene, const std::vector<bool>& still, const std::vector<bool>& left_out,
          const Variant& variant)
      : simulation_(with_threads(1), {.tolerance = variant.tolerance}) {
    for (std::size_t i = 0; i < scene.organs.size(); ++i) {
      const Organ& organ = scene.organs[i];
      if (left_out[i])
        continue;
      if (i == scene.touched)
        touched_ = simulation_.object_count();
      std::shared_ptr<compliance::ComplianceSource> source;
      if (still[i]) {
        source = compliance::compliance_of_factor(
            [&organ] { return linalg::Factor(fem::stiffness_matrix(organ.model), Context{}); });
        if (i == scene.touched && variant.store != nullptr)
          source = variant.store->compliance();
      }
      simulation_.add_object(organ.name, organ.model,
                             still[i] ? scene::Method::ffe : scene::Method::ela, std::move(source));
      if (!still[i]) { // what keeps it moving
        const std::size_t object = simulation_.object_count() - 1;
        const double weight = 1e-3 * 9810 * model::total_mass(organ.model);
        simulation_.apply(
            scene::SetForce{object, {patch(organ.model).back()}, {0, 0, weight}, 0.8});
      }
    }
    if (!left_out[scene.touched]) {
      nodes_ = patch(scene.organs[scene.touched].model);
      amplitude_ = 0.001 * test::mean_edge(scene.organs[scene.touched].model);
    }
  }

  /// Milliseconds of one.
  double cycle(std::size_t contacts, const Cycle& kind) {
    return processor_milliseconds([&] {
      for (std::size_t k = 0; k < contacts; ++k) {
        simulation_.apply(scene::SetDisplacement{touched_, {nodes_[k]}, amplitude_ * any()});
      }
      simulation_.step(kind.duration);
      if (!kind.shapes) {
        for (const contact::NodeVector& force : simulation_.contact_forces(touched_))
          sum_ += force.value.x;
        return;
      }
      for (std::size_t i = 0; i < simulation_.object_count(); ++i)
        sum_ += simulation_.displacement(i)[0];
    });
  }

private:
  scene::Simulation simulation_;
  /// No displacement is a sum of earlier ones.
  Vec3 any() {
    Vec3 v;
    for (int a = 0; a < 3; ++a)
      v[a] = static_cast<double>(engine_()) / 2147483648.0 - 1;
    return v;
  }

  std::size_t touched_ = 0;
  std::vector<std::uint32_t> nodes_;
  double amplitude_ = 0, sum_ = 0;
  std::mt19937 engine_{7190};
};

std::vector<bool> hybrid(const Scene& scene) {
  std::vector<bool> still;
  for (const Organ& organ : scene.organs)
    still.push_back(organ.still);
  return still;
}

/// No load: from no elastostatic organ to all, each beside the scene without them.
void without_load(const Scene& scene) {
  const std::string stage = scene.name + " without load over elastostatic nodes (percent)";
  const std::size_t count = scene.organs.size();
  const std::vector<bool> none(count, false), all = hybrid(scene);
  std::vector<bool> still = none;
  double alone = 0, last = 0, worst = 1;
  for (std::size_t k = count + 1; k-- > 0;) { // the last ones first, the touched one last
    if (k < count && !all[k])
      continue;
    if (k < count)
      still[k] = true;
    Running with(scene, still, none, {}), without(scene, still, still, {});
    std::vector<double> a, b;
    (void)with.cycle(0, {frame});
    (void)without.cycle(0, {frame});
    for (int run = 0; run < 5; ++run) { // by turns, for the machine's own pace changes
      a.push_back(with.cycle(0, {frame}));
      b.push_back(without.cycle(0, {frame}));
    }
    const Times t = times_of(a), rest = times_of(b);
    last = 1e3 / t.median;
    if (k == count)
      alone = last;
    else
      worst = test::smaller(worst, rest.fastest / t.fastest);
    report(stage, "hybrid", share(scene, still), 0, t, last, "cycles/s");
    report(stage, "without its elastostatic organs", share(scene, still), 0, rest,
           1e3 / rest.median, "cycles/s");
  }
  (void)std::fprintf(
      stderr,
      "%s, no load, %.1f %% elastostatic: %.2f times the speed of elastodynamics "
      "alone; at least %.1f %% of that without the elastostatic organs (fastest cycles)\n",
      scene.name.c_str(), share(scene, all), last / alone, 100 * worst);
}

/// The contacts at which a falling curve of cycles/s crosses another, or -1.
double crossing(const std::vector<std::size_t>& contacts, const std::vector<double>& curve,
                const std::vector<double>& other) {
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const double gap = curve[k] - other[k];
    if (gap > 0)
      continue;
    if (k == 0)
      return 0;
    const double before = curve[k - 1] - other[k - 1];
    const auto a = static_cast<double>(contacts[k - 1]), b = static_cast<double>(contacts[k]);
    return a + (b - a) * before / (before - gap);
  }
  return -1;
}

void with_contacts(const Scene& scene, const std::vector<Variant>& variants,
                   const std::vector<std::size_t>& contacts, const Cycle& kind) {
  const std::string what = kind.name, stage = scene.name + "; " + what + " over contacts";
  const std::vector<bool> none(scene.organs.size(), false), still = hybrid(scene);
  std::vector<const char*> names{"elastodynamics alone"};
  std::vector<std::unique_ptr<Running>> scenes;
  scenes.push_back(std::make_unique<Running>(scene, none, none, Variant{}));
  for (const Variant& variant : variants) {
    names.push_back(variant.name);
    scenes.push_back(std::make_unique<Running>(scene, still, none, variant));
  }
  std::vector<std::vector<double>> curves(scenes.size());
  for (const std::size_t m : contacts) {
    std::vector<std::vector<double>> times(scenes.size());
    for (int round = 0; round < 3; ++round) // by turns, for the machine's own pace changes
      for (std::size_t k = 0; k < scenes.size(); ++k) {
        if (round == 0 || kind.burst > 1)
          (void)scenes[k]->cycle(m, kind); // what it needs comes to memory, or to the caches
        for (int run = 0; run < kind.burst; ++run)
          times[k].push_back(scenes[k]->cycle(m, kind));
      }
    for (std::size_t k = 0; k < scenes.size(); ++k) {
      const Times t = times_of(times[k]);
      curves[k].push_back(1e3 / t.median);
      report(stage, names[k], static_cast<double>(m), m, t, curves[k].back(), "cycles/s");
    }
  }
  for (std::size_t k = 1; k < scenes.size(); ++k) {
    const double cross = crossing(contacts, curves[k], curves[0]);
    char text[64];
    if (cross < 0)
      (void)std::snprintf(text, sizeof text, "none up to %zu", contacts.back());
    else
      (void)std::snprintf(text, sizeof text, "at %.0f", cross);
    (void)std::fprintf(stderr,
                       "%s, %s, %s: break-even %s contacts; %.2f times as fast with none, %.2f "
                       "with %zu\n",
                       scene.name.c_str(), what.c_str(), names[k], text,
                       curves[k].front() / curves[0].front(), curves[k].back() / curves[0].back(),
                       contacts.back());
  }
}

/// The integration step that every object takes when each takes one.
double min_step(const Scene& scene) {
  double min = HUGE_VAL;
  for (const Organ& organ : scene.organs)
    min = test::smaller(min, dynamics::safe_step_fraction * model::safe_step(organ.model));
  return min;
}

// ---- the same shape from both

std::vector<double> shape_of(const dynamics::BodyMotion& object) {
  std::vector<double> u;
  for (const dynamics::NodeMotion& m : object.motion())
    for (int a = 0; a < 3; ++a)
      u.push_back(m.displacement[a]);
  return u;
}

/// Largest difference over the largest entry of b.
double difference(std::span<const double> a, std::span<const double> b) {
  double error = 0, size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double e = std::abs(a[i] - b[i]);
    error = test::larger(error, e);
    size = test::larger(size, std::abs(b[i]));
  }
  return error / size;
}

/// A smooth pull of the m first nodes, of about `size` mm, one for each `wave`.
contact::Load pull(const model::Model& model, const std::vector<std::uint32_t>& nodes,
                   std::size_t m, double size, double wave = 0) {
  contact::Load load;
  for (std::size_t k = 0; k < m; ++k) {
    const Vec3& at = model.nodes[nodes[k]].position;
    load.displacement[nodes[k]] =
        size * Vec3{0.5 * std::sin(at.y / (30 + wave)), 0.5 * std::cos(at.x / (30 + wave)), 1};
  }
  return load;
}

void equal_error(const Organ& organ, const Stored& store) {
  constexpr double near = 1e-3, part_of_edge = 1e-6, longest = 60; // s
  const model::Model& model = organ.model;
  const std::vector<std::uint32_t> nodes = patch(model);
  const double size = part_of_edge * test::mean_edge(model);
  const std::string stage =
      organ.name + "; within 1e-3 of the linear equilibrium over contacts (log)";
  std::vector<std::size_t> contacts;
  for (const std::size_t m : std::vector<std::size_t>{1, 2, 5, 10, 20, 50, 100, 200, 500, 1000})
    if (m < nodes.size())
      contacts.push_back(m);
  contacts.push_back(nodes.size() - 1);
  contacts.push_back(nodes.size());
  const Context one = with_threads(1);
  double min = HUGE_VAL;
  std::size_t min_at = 0;
  for (const std::size_t m : contacts) {
    const contact::Load load = pull(model, nodes, m, size);
    // The reference holds the nodes in the matrix.
    statics::Elastostatic exact(model, {}, one, {.block_limit = 0});
    exact.update(load);
    const std::vector<double> linear(exact.displacement().begin(), exact.displacement().end());

    std::vector<double> fresh, known;
    std::vector<contact::NodeVector> held;
    double error = 0;
    for (int run = 0; run < 3; ++run) {
      statics::Elastostatic still(model, store.compliance(), one);
      still.update({.gravity = {0, 0, -1}}); // so that the store's factor is at hand
      (void)still.displacement();
      std::vector<double> u;
      fresh.push_back(processor_milliseconds([&] {
        still.update(load);
        const std::span<const double> shape = still.displacement();
        u.assign(shape.begin(), shape.end());
        held = still.contact_forces();
      }));
      error = test::larger(error, difference(u, linear));
      for (int turn = 1; turn <= 3; ++turn) {
        still.update(pull(model, nodes, m, size, turn));
        (void)still.displacement();
      }
      known.push_back(processor_milliseconds([&] {
        still.update(load);
        const std::span<const double> shape = still.displacement();
        u.assign(shape.begin(), shape.end());
        held = still.contact_forces();
      }));
    }
    if (!(error < near))
      throw Error("an elastostatic shape is wrong by " + std::to_string(error));

    dynamics::Elastodynamic moving(model);
    const double h = dynamics::safe_step_fraction * model::safe_step(model);
    std::vector<double> u;
    double spent = processor_milliseconds([&] {
      moving.set_load(load);
      (void)moving.advance(h, h, one);
      u = shape_of(moving);
      held = moving.contact_forces();
    });
    double time = h, off = difference(u, linear);
    double chunk = h;
    while (!(off < near) && time < longest) {
      chunk = std::max(h, 0.02 * time);
      spent += processor_milliseconds([&] {
        (void)moving.advance(chunk, h, one, time);
        u = shape_of(moving);
        held = moving.contact_forces();
      });
      time += chunk;
      off = difference(u, linear);
    }
    const Times still_new = times_of(fresh), still_known = times_of(known);
    const auto x = static_cast<double>(m);
    report(stage, "elastostatic; new contacts", x, m, still_new, still_new.median, "ms");
    report(stage, "elastostatic; contacts moved", x, m, still_known, still_known.median, "ms");
    report(stage, off < near ? "elastodynamic to rest" : "elastodynamic; given up after 60 s", x, m,
           {spent, spent, spent}, spent, "ms");
    const double ratio = spent / still_new.median;
    if (!(ratio >= min))
      min_at = m;
    min = test::smaller(min, ratio);
    (void)std::fprintf(stderr,
                       "%s, %zu contacts: elastostatic %.3f ms new, %.3f ms moved (off by "
                       "%.1e), elastodynamic %.1f ms for %.3f s\n",
                       organ.name.c_str(), m, still_new.median, still_known.median, error, spent,
                       time);
  }
  (void)std::fprintf(stderr, "%s, equal error: at least %.1f times as fast, at %zu contacts\n",
                     organ.name.c_str(), min, min_at);
}

/// How far the linear shape is from the non-linear one, where implicit steps come to rest.
void linearisation(const Organ& organ) {
  const model::Model& model = organ.model;
  const std::vector<std::uint32_t> nodes = patch(model);
  const std::string stage = organ.name + "; 5 nodes pulled over pull in edges (log)";
  for (const double part : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1}) {
    const contact::Load load = pull(model, nodes, 5, part * test::mean_edge(model));
    statics::Elastostatic still(model, {}, with_threads(1));
    integrator::SolidChoice exact;
    exact.tolerance = 1e-9;
    dynamics::SolidDynamic moving(model, exact, with_threads(1));
    std::vector<double> u;
    const double spent = processor_milliseconds([&] {
      moving.set_load(load, 0);
      for (int k = 0; k < 60 && !moving.resting(); ++k)
        (void)moving.advance(1, 0.5, with_threads(1), k);
      u = shape_of(moving);
    });
    still.update(load);
    report(stage, "linear against non-linear rest shape", part, 5, {spent, spent, spent},
           difference(still.displacement(), u), "largest error over largest displacement");
  }
}

void figure_4_9(const Scene& scene, const std::vector<std::size_t>& contacts) {
  const model::Model& touched = scene.organs[scene.touched].model;
  std::vector<std::uint32_t> nodes = patch(touched);
  nodes.resize(std::min(nodes.size(), max_contacts));
  const Stored wide(touched, nodes, Stored::Kept::float64),
      narrow(touched, nodes, Stored::Kept::float32),
      compressed(touched, nodes, Stored::Kept::compressed);
  const std::vector<Variant> variants{{"hybrid float64", &wide, 0},
                                      {"hybrid float64 tolerance 1e-3", &wide, 1e-3},
                                      {"hybrid float32", &narrow, 0},
                                      {"hybrid float32 tolerance 1e-3", &narrow, 1e-3},
                                      {"hybrid compressed 1e-6", &compressed, 0}};
  without_load(scene);
  const double step = min_step(scene);
  with_contacts(scene, variants, contacts, {frame, true, 1, "cycles of 1/60 s"});
  with_contacts(scene, variants, contacts, {step, true, 7, "cycles of one step"});
  with_contacts(scene, variants, contacts, {step, false, 7, "cycles of one step, forces alone"});
  if (scene.name == "made organs") {
    equal_error(scene.organs[scene.touched], wide);
    linearisation(scene.organs[scene.touched]);
  }
}

} // namespace

int main() {
  std::puts("stage,program,size,contacts,threads,median_ms,fastest_ms,slowest_ms,figure,unit");
  try {
    figure_4_9(example(), {0, 1, 2, 5, 10, 14, 20, 40, 60, 100, 150, 200});
    if (const Scene scene = shared_organs(); !scene.organs.empty())
      figure_4_9(scene, {0, 14, 60, 100, 200});
  } catch (const Error& error) {
    (void)std::fprintf(stderr, "break_even: %s: %s\n", error.place().c_str(), error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
