#include "tools/model/solid_accuracy.h"

#include "formats/scene/scene.h"
#include "formats/stream/stream.h"
#include "text/number_text.h"
#include "text/rounded_text.h"
#include "tools/cli/progress_bar.h"
#include "tools/model/model_source.h"
#include "tools/model/shape_error.h"
#include "tools/results/scene_estimate.h"
#include "tools/run/scene_run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <numeric>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

namespace gewebe::cli {

namespace {

constexpr std::int64_t usual_max_tetrahedra = 50000;
constexpr double most_of_error = 0.8; // of an object in a step, in the elements that are refined
constexpr double to_spare = 0.6;      // part of the allowed error that the others may have

/// The scene, and which of its objects have the model that is built.
struct GoalScene {
  std::string name;
  std::vector<std::string> lines;
  std::set<std::string> files;   ///< as the scene names the model
  std::set<std::string> objects; ///< that have it
};

/// Whether two paths are those of one file, which need not exist.
bool same_file(const std::string& a, const std::string& b) {
  return std::filesystem::weakly_canonical(a) == std::filesystem::weakly_canonical(b);
}

void add_object(GoalScene& scene, const std::string& output, const formats::ObjectCommand& object) {
  const bool built = output == "-" ? scene.files.empty() || scene.files.contains(object.model)
                                   : same_file(scene_file_path(scene.name, object.model), output);
  if (!built && output == "-")
    throw Error("objects have the models " + *scene.files.begin() + " and " + object.model +
                ", expected one, or -o with the name of the one that is built");
  if (!built)
    return;
  if (!object.store.empty())
    throw Error("object " + object.name +
                " has a store, expected none: its model is not built yet");
  scene.files.insert(object.model);
  scene.objects.insert(object.name);
}

/// Numbers of nodes are others in each mesh.
void require_places(const GoalScene& scene, const formats::ChangeCommand& change) {
  const auto by_number = [&](const std::string& object,
                             const std::optional<model::Selector>& nodes) {
    return nodes && scene.objects.contains(object) && has_node_numbers(*nodes);
  };
  if (by_number(change.object, change.nodes) || by_number(change.other, change.others))
    throw Error("nodes have other numbers in each mesh of --accuracy, expected places");
}

GoalScene read_scene(const std::string& path, const std::string& output) {
  formats::Input input(path, false);
  GoalScene scene{input.name(), {}, {}, {}};
  const std::string text = input.read_all();
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    scene.lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  for (std::size_t k = 0; k < scene.lines.size(); ++k)
    at(scene.name + ":" + std::to_string(k + 1), [&] {
      const std::optional<formats::Command> command = formats::parse_scene_line(scene.lines[k]);
      if (!command)
        return;
      if (const auto* const object = std::get_if<formats::ObjectCommand>(&command->what))
        add_object(scene, output, *object);
      if (const auto* const change = std::get_if<formats::ChangeCommand>(&command->what))
        require_places(scene, *change);
    });
  if (scene.objects.empty())
    throw Error(scene.name, "no object has the model that is built, expected 'object NAME FILE' "
                            "with the FILE of -o");
  return scene;
}

/// Answer of an object in a step, with its estimated error.
struct Answer {
  std::uint64_t step = 0;
  std::string object;
  bool is_force = false; ///< else the largest displacement
  double value = 0;      ///< 1e-6 N or mm
  double mesh = 0;       ///< relative error that the elements cause
  double shape = 0;      ///< and their surface

  double error() const { return mesh + shape; }
};

/// A place where cells shall be at most as large.
struct Mark {
  Vec3 place;
  double cell = 0;
};

struct Solution {
  std::vector<Answer> answers; ///< of objects that are deformed
  std::vector<Mark> marks;     ///< where their errors are
};

/// Edge of the lattice's cell that a tetrahedron is of, about: a power of two times `cell`. Edges
/// of a body-centred lattice are 0.87 and 1 cells long, those beside larger cells up to 1.41.
double cell_of(const tetrahedra::TetMesh& mesh, const Tetrahedron& t, double cell) {
  constexpr double longest = 1.42;
  double edge = 0;
  for (const auto& [i, j] : tetrahedra::tetrahedron_edges)
    edge = std::fmax(edge, norm(mesh.points[t[i]] - mesh.points[t[j]]));
  while (edge > longest * cell)
    cell *= 2;
  while (edge <= longest / 2 * cell)
    cell /= 2;
  return cell;
}

/// The fewest elements with all but a part of the error.
/// \param errors  by element, relative
void mark(const tetrahedra::TetMesh& mesh, std::span<const double> errors, double wanted,
          double cell, std::vector<Mark>& marks) {
  std::vector<std::uint32_t> order(errors.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, [&](auto a, auto b) { return errors[a] > errors[b]; });
  double left = std::accumulate(errors.begin(), errors.end(), 0.0);
  const double enough = std::fmax((1 - most_of_error) * left, to_spare * wanted);
  for (const std::uint32_t t : order) {
    if (!(left > enough))
      return;
    left -= errors[t];
    const Tetrahedron& corners = mesh.tetrahedra[t];
    Vec3 centre;
    for (const std::uint32_t corner : corners)
      centre += 0.25 * mesh.points[corner];
    marks.push_back({centre, cell_of(mesh, corners, cell) / 2});
  }
}

/// What objects that have the model answer to a step.
class AnswerReader {
public:
  AnswerReader(const GoalScene& scene, const ShapeError& shape, double wanted, double cell,
               Solution& solution)
      : scene_(scene), shape_(shape), wanted_(wanted), cell_(cell), solution_(solution) {}

  void read(const scene::Simulation& simulation, const SceneEstimates& estimates,
            std::span<const formats::EstimateAnswer> answers) {
    ++step_;
    for (const formats::EstimateAnswer& answer : answers) {
      const scene::ObjectFacts facts = simulation.object(answer.object);
      if (!scene_.objects.contains(facts.name) || !facts.known)
        continue;
      if (!answer.error)
        throw Error("the error of object " + facts.name +
                    " can't be estimated, expected method=ffe without law=, rotation=warp and "
                    "two-step");
      const std::optional<ElementErrors> elements = estimates.elements(answer.object);
      if (!elements)
        continue; // nothing is deformed
      solution_.answers.push_back(answer_of(simulation, answer.object, *answer.error, *elements));
    }
  }

private:
  Answer answer_of(const scene::Simulation& simulation, std::size_t object,
                   const fem::DiscretisationError& found, const ElementErrors& elements) {
    const std::vector<contact::NodeVector>& forces = simulation.contact_forces(object);
    Vec3 force;
    for (const contact::NodeVector& f : forces)
      force += f.value;
    const bool is_force = norm(force) > 0;
    const double moved = found.relative > 0 ? found.displacement / found.relative : 0;
    Answer answer{step_, simulation.object(object).name, is_force, is_force ? norm(force) : moved,
                  found.relative};
    bool touched = simulation.object_count() > 1;
    for (std::size_t n = 0; n < simulation.instrument_count(); ++n)
      touched = touched || simulation.instrument(n).nodes > 0;
    std::vector<double> errors = shape_.energies(
        elements, touched ? std::span(forces) : std::span<const contact::NodeVector>());
    answer.shape = std::abs(std::accumulate(errors.begin(), errors.end(), 0.0)) / elements.total;
    for (std::size_t t = 0; t < errors.size(); ++t)
      errors[t] = (std::abs(errors[t]) + elements.energy[t]) / elements.total;
    if (!(answer.error() <= wanted_))
      mark(*elements.mesh, errors, wanted_, cell_, solution_.marks);
    return answer;
  }

  const GoalScene& scene_;
  const ShapeError& shape_;
  double wanted_, cell_;
  Solution& solution_;
  std::uint64_t step_ = 0;
};

Solution solve(Run& run, const GoalScene& scene, const ModelArguments& a, const ShapeError& shape,
               const FilledSolid& solid) {
  Solution solution;
  AnswerReader reader(scene, shape, a.accuracy.error, solid.cell, solution);
  SceneOptions options;
  options.files = scene_files(scene.name, run.context());
  options.files.check = [&scene, check = options.files.check](const std::string& name) {
    if (!scene.files.contains(name))
      check(name);
  };
  options.files.model = [&, read = options.files.model](const std::string& name) {
    if (!scene.files.contains(name))
      return read(name);
    model::Model model = solid.model;
    fix_nodes(model, a);
    return model;
  };
  options.files.write_model = nullptr; // a scene that is only tried leaves nothing
  options.estimate = true;
  options.estimated = [&](const scene::Simulation& simulation, const SceneEstimates& estimates,
                          std::span<const formats::EstimateAnswer> answers) {
    reader.read(simulation, estimates, answers);
  };
  SceneRun scene_run(scene.name, run.context(), options);
  for (const std::string& line : scene.lines)
    if (!scene_run.ended())
      scene_run.line(line);
  scene_run.finish();
  if (solution.answers.empty())
    throw Error(scene.name, "no step deforms the model that is built, expected a load and a step");
  return solution;
}

/// One region for each cell that is marked: the marks in it have one place.
void add_regions(const std::vector<Mark>& marks, double scale,
                 std::vector<tetrahedra::RefinedRegion>& regions) {
  std::set<std::array<double, 4>> seen;
  for (const Mark& m : marks) {
    const double cell = m.cell * scale;
    if (!seen.insert({cell, std::floor(m.place.x / cell), std::floor(m.place.y / cell),
                      std::floor(m.place.z / cell)})
             .second)
      continue;
    tetrahedra::RefinedRegion& region = regions.emplace_back();
    region.text = "--accuracy";
    region.spheres.push_back({m.place, 1e-6 * cell});
    region.cell = cell;
  }
}

std::string percent(double share) {
  std::array<char, 40> text{};
  (void)std::snprintf(text.data(), text.size(), "%.1f %%", 100 * share);
  return text.data();
}

constexpr const char* heading =
    "round  tetrahedra  step  quantity                       value     mesh     shape   seconds";

std::string row(std::size_t round, std::size_t tetrahedra, const Answer& worst, double seconds) {
  std::array<char, 200> text{};
  const std::string what = (worst.is_force ? "force on " : "displacement of ") + worst.object;
  const std::string value = text::rounded_text(worst.is_force ? worst.value / 1000 : worst.value) +
                            (worst.is_force ? " mN" : " mm");
  (void)std::snprintf(text.data(), text.size(),
                      "%5zu  %10zu  %4llu  %-25.60s %10s  %8s  %8s  %8.1f", round, tetrahedra,
                      static_cast<unsigned long long>(worst.step), what.c_str(), value.c_str(),
                      percent(worst.mesh).c_str(), percent(worst.shape).c_str(), seconds);
  return text.data();
}

void report(Run& run, std::size_t rounds, const Answer& worst) {
  run.stats().set("accuracy_rounds", std::uint64_t{rounds});
  run.stats().set("accuracy_mesh_error", worst.mesh);
  run.stats().set("accuracy_shape_error", worst.shape);
  run.stats().set("accuracy_step", worst.step);
  run.stats().set(worst.is_force ? "accuracy_force" : "accuracy_displacement", worst.value);
}

} // namespace

FilledSolid accurate_solid(Run& run, const ModelArguments& a, const TriangleMesh& surface,
                           const FillSolid& fill) {
  const GoalScene scene = read_scene(a.accuracy.scene, run.output());
  const auto most =
      static_cast<std::uint64_t>(a.accuracy.max_tetrahedra.value_or(usual_max_tetrahedra));
  const ShapeError shape(surface);
  std::vector<tetrahedra::RefinedRegion> regions;
  Solution solution;
  std::optional<Answer> worst;
  std::size_t before = 0;
  for (std::size_t round = 1;; ++round) {
    const double start = now_seconds();
    FilledSolid solid = fill(regions);
    const std::size_t tetrahedra = solid.model.tetrahedra.size();
    if (tetrahedra > most)
      throw Error(
          "an accuracy of " + a.accuracy.text + " needs over " + std::to_string(most) +
          " tetrahedra, " +
          (worst ? "reached " + percent(worst->error()) + " with " + std::to_string(before) + ", "
                 : "") +
          "expected a larger --max-tets or --accuracy");
    // Cells that were larger than they seemed are halved again.
    const double scale = tetrahedra > before ? 1 : 0.5;
    before = tetrahedra;
    solution = run.timed("solve", [&] { return solve(run, scene, a, shape, solid); });
    worst = *std::ranges::max_element(solution.answers, {}, &Answer::error);
    if (round == 1)
      run.tell(heading);
    run.tell(row(round, tetrahedra, *worst, now_seconds() - start));
    if (worst->error() <= a.accuracy.error) {
      report(run, round, *worst);
      return solid;
    }
    add_regions(solution.marks, scale, regions);
  }
}

} // namespace gewebe::cli
