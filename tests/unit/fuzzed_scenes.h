#pragma once
// Random scenes on small models, and what must hold for any of them: served, none ends the session
// or tells a number that is none, each line is acknowledged in its turn, and shared shapes are
// those of the answers; its record, run again with two threads, gives the same answers, results and
// digest to the last byte.

#include "base/digest.h"
#include "base/error.h"
#include "contact/convex_core.h"
#include "fem/model_stiffness.h"
#include "fem/solid_model.h"
#include "linalg/condition.h"
#include "model/build.h"
#include "model/primitive.h"
#include "tests/bench/memory_columns.h"
#include "tests/unit/convex_meshes.h"
#include "tests/unit/fuzzed_door.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/scratch.h"
#include "tests/unit/simulation_scenes.h"
#include "tests/unit/tet_fixtures.h"
#include "text/number_text.h"
#include "tools/run/event_log.h"
#include "tools/run/scene_record.h"
#include "tools/run/scene_run.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::test {

/// The models by name: held balls, a sheet, a tube, a ball that nothing holds, a shell, two masses,
/// solids of quadratic and of linear elements, the latter free.
inline const std::map<std::string, model::Model>& fuzzed_models() {
  static const std::map<std::string, model::Model> models = [] {
    std::map<std::string, model::Model> all;
    const auto built = [](const TriangleMesh& mesh, std::int32_t centrals) {
      model::BuildOptions options;
      options.bend = true;
      options.centrals = centrals;
      return model::build_model(mesh, options, Context{}).model;
    };
    all["organ"] = organ(1);
    all["ball"] = organ(2);
    all["shell"] = shell();
    all["two"] = two_masses();
    all["free"] = built(ball(2, 12), 0);
    model::Model& sheet_model = all["sheet"] = built(sheet(5, 4, 6), 0);
    for (model::Node& n : sheet_model.nodes)
      n.fixed = n.position.x < 1 ? model::fixed_all : model::fixed_none;
    model::Model& tube = all["tube"] =
        built(model::primitive_mesh({model::PrimitiveShape::tube, 8, 6, 10, 40}), 1);
    for (model::Node& n : tube.nodes)
      if (n.position.z < 1 || n.position.z > 39)
        n.fixed = model::fixed_all;
    for (const bool quadratic : {true, false}) {
      fem::SolidModelOptions options;
      options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.4}};
      options.quadratic = quadratic;
      model::Model& solid = all[quadratic ? "gel" : "loaf"] =
          fem::solid_model(box_tetrahedra(3, 1, 1, 8), options, {});
      for (model::Node& n : solid.nodes)
        if (n.position.x < 1 && quadratic)
          n.fixed = model::fixed_all;
    }
    for (auto& [name, model] : all)
      model.name = name;
    return all;
  }();
  return models;
}

/// The lines of a random scene; the same for the same seed.
class FuzzedScene {
public:
  explicit FuzzedScene(std::uint64_t seed) : random_(seed), contacts_(seed), masses_(~seed) {
    const std::size_t count = 1 + below(3);
    for (std::size_t k = 0; k < count; ++k)
      add_object();
    for (const char* what : {"shapes", "forces", "instruments"})
      if (one_in(2))
        line(std::string("emit ") + what);
    const std::size_t rounds = 4 + below(10);
    for (std::size_t round = 0; round < rounds; ++round) {
      if (contacts_() % 12 == 0) // by numbers of its own, as below
        line(prepare());
      for (std::size_t k = below(4); k > 0; --k)
        command();
      go_on();
    }
    if (one_in(20)) {
      line("end");
      line("step 0.001"); // which is not read
    }
  }
  const std::vector<std::string>& lines() const { return lines_; }

private:
  std::size_t below(std::size_t end) { return static_cast<std::size_t>(random_() % end); }
  bool one_in(std::size_t n) { return below(n) == 0; }
  /// Of four digits, as people type them.
  double real(double low, double high) {
    const double share = static_cast<double>(random_() >> 11U) / 9007199254740992.0;
    const double x = low + (high - low) * share;
    const double digits = std::pow(10, 3 - std::floor(std::log10(std::max(std::abs(x), 1e-9))));
    return std::round(x * digits) / digits;
  }
  template <class T>
  const T& of(const std::vector<T>& all) {
    return all[below(all.size())];
  }
  void line(const std::string& text) { lines_.push_back(text); }

  static std::string numbers(const Vec3& v) {
    return text::number_text(v.x) + " " + text::number_text(v.y) + " " + text::number_text(v.z);
  }
  Vec3 vector(double size) { return {real(-size, size), real(-size, size), real(-size, size)}; }
  /// Seldom what no scene should hold.
  std::string number(double size) {
    static const std::vector<std::string> odd{"1e300",  "-1e300", "1e38", "1e30",
                                              "1e-300", "0",      "-0"};
    return one_in(40) ? of(odd) : text::number_text(real(-size, size));
  }
  std::string triple(double size) {
    const std::string x = number(size), y = number(size);
    return x + " " + y + " " + number(size);
  }
  std::string time() {
    static const std::vector<double> usual{0.001, 0.002, 0.004, 0.01, 0.0015};
    return one_in(60) ? number(1) : text::number_text(of(usual));
  }

  void add_object() {
    std::vector<std::string> names;
    for (const auto& [name, model] : fuzzed_models())
      names.push_back(name);
    const bool filled = one_in(12); // which goes with little else
    if (filled && !one_in(6))
      names = {"organ", "ball", "free"}; // closed nets
    const std::string model = of(names), name(1, static_cast<char>('a' + objects_.size()));
    std::string text = "object " + name + " " + model;
    if (filled) {
      text += std::string(" integration=") + (one_in(2) ? "implicit" : "auto") +
              " bulk=" + text::number_text(one_in(10) ? 1e12 : real(1, 3e6));
    } else {
      if (one_in(2))
        text += " store=" + model;
      text += one_in(3) ? " method=ffe" : one_in(3) ? " method=ela" : "";
      text += one_in(6) ? " integration=implicit" : one_in(8) ? " integration=auto" : "";
      text += one_in(50) ? " bulk=1e4" : "";
    }
    if (!fuzzed_models().at(model).tetrahedra.empty() || one_in(20)) {
      text += one_in(3) ? " law=neo-hookean" : "";
      text += one_in(3) ? " damping=" + text::number_text(real(0, 1)) + "@30" : "";
      text += one_in(5) ? " tolerance=1e-5" : "";
    }
    objects_.push_back({name, &fuzzed_models().at(model)});
    line(text);
    if (one_in(4))
      line(two_step(objects_.back()));
  }

  struct Known {
    std::string name;
    const model::Model* model = nullptr;
  };
  /// Seldom the name of what has come off.
  Known object() {
    Known one = of(objects_);
    if (one_in(12))
      one.name += ".1";
    return one;
  }
  Vec3 place(const model::Model& model) { return of(model.nodes).position; }
  static double size_of(const model::Model& model) {
    Box3 box;
    for (const model::Node& n : model.nodes)
      box.add(n.position);
    return box.longest_side();
  }

  std::string nodes(const model::Model& model) {
    const auto node = [&] { return std::to_string(below(model.nodes.size())); };
    const Vec3 p = place(model);
    const double size = size_of(model);
    switch (below(10)) {
    case 0:
      return "surface";
    case 1:
      return one_in(2) ? "all" : "@list";
    case 2:
      return std::string(1, "xyz"[below(3)]) + (one_in(2) ? "<" : ">") +
             text::number_text(p[static_cast<int>(below(3))]);
    case 3:
      return "sphere:" + text::number_text(p.x) + "," + text::number_text(p.y) + "," +
             text::number_text(p.z) + "," + text::number_text(real(0.05, 0.5) * size);
    case 4:
      return "\"" + node() + " or not (x<" + text::number_text(p.x) + ")\"";
    case 5:
      return node() + "-" + std::to_string(model.nodes.size() - 1);
    case 6:
      return node() + "," + node();
    default:
      return node();
    }
  }

  std::string instrument() {
    static const std::vector<std::string> names{"p", "q", "k", "j"};
    return instruments_.empty() || one_in(6) ? of(names) : of(instruments_);
  }
  /// Each shape has its name.
  std::string new_instrument(const std::string& name) {
    instruments_.push_back(name);
    return "instrument " + name;
  }
  std::string put_instrument() {
    const Known o = object();
    const double size = size_of(*o.model);
    const Vec3 at = place(*o.model) + vector(0.3 * size);
    if (one_in(3))
      return new_instrument("k") + " blade " + (one_in(20) ? triple(1e300) : numbers(at)) + " " +
             numbers(at + vector(size));
    const std::string friction = one_in(2) ? " friction " + text::number_text(real(0, 1.5)) : "";
    if (one_in(4))
      return new_instrument("j") + " mesh jaw" + std::to_string(1 + below(4)) + ".ply" +
             (one_in(2) ? " radius=" + text::number_text(real(0.01, 0.2) * size) : "") + " " +
             numbers(at) + (one_in(2) ? " turn " + numbers(vector(1)) + " " + number(180) : "") +
             friction;
    const std::string radius = one_in(30) ? number(1e3) : text::number_text(real(0.05, 0.4) * size);
    if (one_in(2))
      return new_instrument("q") + " capsule " + radius + " " + numbers(at) + " " +
             numbers(at + vector(0.5 * size)) + friction;
    return new_instrument("p") + " sphere " + radius + " " + numbers(at) + friction;
  }
  std::string move_instrument() {
    const Known o = object();
    const std::string to = one_in(30) ? triple(1e9) : numbers(place(*o.model) + vector(5));
    std::string text = "move " + instrument() + " " + to;
    if (one_in(3))
      text += " turn " + numbers(vector(1)) + " " + number(180);
    return text + (one_in(2) ? " over " + time() : "");
  }
  std::string load() {
    const Known o = object();
    const std::string whom = o.name + " " + nodes(*o.model) + " ";
    const std::string period = one_in(4) ? " period " + time() : "";
    switch (below(6)) {
    case 0:
      return "pressure " + whom + number(5000) + period;
    case 1:
    case 2:
      return "force " + whom + triple(5e4) + (one_in(3) ? " total" : "") + period;
    case 3:
      return "release " + whom;
    default:
      return "displace " + whom + triple(0.2 * size_of(*o.model)) +
             (one_in(2) ? " over " + time() : "");
    }
  }
  std::string cut() {
    const Known o = object();
    if (one_in(3))
      return "restore " + o.name;
    if (one_in(4))
      return "tear " + o.name + " " + text::number_text(real(0, 0.3));
    if (one_in(o.model->tetrahedra.empty() ? 3 : 20))
      return "cut " + o.name + " springs " + nodes(*o.model) +
             (one_in(2) ? " " + nodes(*o.model) : "");
    return "cut " + o.name + " plane " + numbers(place(*o.model)) + " " + numbers(vector(2)) +
           (one_in(3) ? " " + nodes(*o.model) : "") + (one_in(8) ? " along=faces" : "");
  }
  std::string two_step(const Known& o) {
    const double threshold = one_in(2) ? real(1, 1e4) : real(1e3, 1e6);
    return "two-step " + o.name + " " + text::number_text(threshold) +
           (one_in(2) ? " series" : "") + (one_in(2) ? " stage=" + o.model->name + ".stiff" : "");
  }
  std::string question() {
    const Known o = object();
    switch (below(6)) {
    case 0:
      return "objects";
    case 1:
      return "instruments";
    case 2:
      return "select " + o.name + " " + nodes(*o.model);
    case 3:
      return "sync";
    default:
      return "nodes " + o.name + (one_in(3) ? "" : one_in(3) ? " rest" : " positions");
    }
  }
  std::string change() {
    const Known o = object(), other = object();
    switch (below(15)) {
    case 0:
    case 1:
      return put_instrument();
    case 2:
      return move_instrument();
    case 3:
      return one_in(2)   ? "withdraw " + instrument()
             : one_in(5) ? "couple " + instrument() + " off"
                         : "couple " + instrument() + " " + text::number_text(real(1, 1e6)) +
                               (one_in(2) ? " " + text::number_text(real(0, 1e4)) : "");
    case 14:
      return "grasp " + o.name + " " + nodes(*o.model) + " " + instrument();
    case 4:
    case 5:
      return cut();
    case 6:
      return "method " + o.name + (one_in(2) ? " ffe" : " ela");
    case 7:
      return "attach " + o.name + " " + nodes(*o.model) + " " + other.name + " " +
             nodes(*other.model) + " " + text::number_text(real(10, 5e4));
    case 8:
      return one_in(3)   ? "gravity " + triple(1e4)
             : one_in(4) ? "timestep " + text::number_text(of(std::vector{1e-3, 2e-4, 1e-300})) +
                               (contacts_() % 4 == 0 ? " order=2" : "")
                         : two_step(o);
    default:
      return load();
    }
  }
  std::string prepare() {
    const Known& o = objects_[contacts_() % objects_.size()];
    const auto kind = contacts_() % 4;
    return "prepare " + o.name +
           (kind == 0   ? ""
            : kind == 1 ? " cut"
            : kind == 2 ? " contact"
                        : " contact " + std::to_string(contacts_() % o.model->nodes.size()) + "," +
                              std::to_string(contacts_() % o.model->nodes.size()));
  }
  /// By numbers of its own: the rest of a scene is as it was without.
  std::string contact() {
    const auto name = [&] { return objects_[contacts_() % objects_.size()].name; };
    const std::string one = name(), other = contacts_() % 3 == 0 ? "self" : name();
    return "contact " + one + " " + other + (contacts_() % 4 == 0 ? " separate" : "") +
           (contacts_() % 2 == 0
                ? " friction " + text::number_text(static_cast<double>(contacts_() % 100) / 50)
                : "");
  }
  /// As well.
  std::string mass() {
    const Known& o = objects_[masses_() % objects_.size()];
    const auto node = [&] { return std::to_string(masses_() % o.model->nodes.size()); };
    const std::string grams = masses_() % 40 == 0
                                  ? "1e30"
                                  : text::number_text(static_cast<double>(masses_() % 2000) / 1000);
    return "mass " + o.name + " " + node() + "," + node() + " " + grams +
           (masses_() % 3 == 0 ? " each" : "");
  }
  void command() {
    if (masses_() % 16 == 0)
      line((masses_() % 4 == 0 ? "at " + text::number_text(now_ + 0.0015) + " " : "") + mass());
    if (contacts_() % 8 == 0)
      line(contact());
    if (one_in(6))
      line(question());
    if (one_in(30))
      line(next_client);
    if (one_in(80)) {
      line("emit stress " + object().name + (one_in(2) ? " all" : ""));
    } else if (one_in(40)) {
      line("emit " +
           of(std::vector<std::string>{"shapes", "surfaces", "forces", "instruments", "all"}));
    } else if (one_in(60)) {
      line("sync");
    } else if (one_in(50) && objects_.size() < 5) {
      add_object();
    } else if (one_in(5)) {
      line("at " + text::number_text(now_ + of(std::vector{0.001, 0.003, 0.0005, 0.01, -0.002})) +
           " " + change());
    } else if (one_in(8)) {
      line("at every " + time() + " " + change());
    } else {
      line(change());
    }
  }
  void go_on() {
    static const std::vector<double> usual{0.001, 0.002, 0.0025, 0.005, 0};
    if (one_in(12)) {
      now_ += 0.004;
      line("run " + text::number_text(now_) + " every " +
           text::number_text(of(std::vector{0.001, 0.0015})));
    } else if (one_in(40)) {
      line("step " + number(1e-3));
    } else {
      const double dt = of(usual);
      now_ += dt;
      line("step " + text::number_text(dt));
    }
  }

  std::mt19937_64 random_, contacts_, masses_;
  std::vector<Known> objects_;
  std::vector<std::string> instruments_; ///< that were put somewhere
  std::vector<std::string> lines_;
  double now_ = 0;
};

/// A random scene with lines and steps that fail in between, of all methods and laws; solids turn
/// as they like where they can.
inline std::vector<std::string> failing_scene(std::uint64_t seed) {
  std::mt19937_64 random(seed * 2654435761U + 1);
  const auto one_in = [&](std::uint64_t n) { return random() % n == 0; };
  std::vector<std::string> lines, objects;
  const FuzzedScene calm(seed);
  for (std::string line : calm.lines()) {
    std::istringstream words(line);
    std::string verb, name, model;
    words >> verb >> name >> model;
    if (verb == "object") {
      objects.push_back(name);
      if (!one_in(3) && line.find("bulk=") == std::string::npos) { // most are solids
        const std::string other = one_in(4) ? "loaf" : "gel";
        if (const std::size_t store = line.find("store=" + model); store != std::string::npos)
          line.replace(store + 6, model.size(), other);
        line.replace(verb.size() + name.size() + 2, model.size(), other);
        model = other;
      }
      const bool solid = model == "gel" || model == "loaf";
      if (solid && line.find(" law=") == std::string::npos && one_in(2))
        line +=
            line.find(" method=") == std::string::npos && line.find(" store=") == std::string::npos
                ? " method=ffe rotation=warp"
            : line.find(" method=ela") == std::string::npos ? " rotation=warp"
                                                            : "";
    }
    lines.push_back(line);
    if (verb != "step" || !one_in(2))
      continue;
    const std::string& o = objects[random() % objects.size()];
    const std::string node = std::to_string(random() % 12);
    switch (random() % 6) {
    case 0: // no number that a step can hold
      lines.insert(lines.end(), {"force " + o + " " + node + " 0 1e300 0", "step 0.001",
                                 "release " + o + " " + node, "step 0.001"});
      break;
    case 1: // squeezed through itself
      lines.insert(lines.end(),
                   {"contact " + o + " self", "displace " + o + " x<8 40 3 1 over 0.001",
                    "step 0.001", "release " + o + " all", "step 0.002"});
      break;
    case 2: // an instrument through the body
      lines.insert(lines.end(),
                   {"instrument z sphere 3 60 60 60", "step 0", "move z -30 -30 -30 over 0.001",
                    "step 0.001", "withdraw z", "step 0.001"});
      break;
    case 3: // a cut that can't be, now and in a step
      lines.insert(lines.end(),
                   {"cut " + o + " plane 900 0 0 1 0 0",
                    "at " + text::number_text(1e-9) + " cut " + o + " plane 900 0 0 1 0 0",
                    "at every 0.0005 cut " + o + " plane 900 0 0 1 0 0", "step 0.001"});
      break;
    case 4: // lines that are none
      lines.insert(lines.end(), {"displace " + o + " " + node + " 1 2", "squeeze " + o,
                                 "method " + o + (one_in(2) ? " ffe" : " ela"), "step -1"});
      break;
    default:
      lines.insert(lines.end(), {"displace " + o + " " + node + " 2 -3 4 over 0.003", "step 0.001",
                                 "gravity 0 1e39 0", "step 0.001", "gravity 0 -900 0", "step 0.001",
                                 "gravity 0 0 0"});
    }
  }
  return lines;
}

/// Digests what a result is told, and notes what no result may be told.
class CheckedResult final : public formats::ResultWriter {
public:
  void add_object(const std::string& name, const model::Model& model) override {
    add(name, model, "object");
  }
  void add_part(const std::string& name, const model::Model& model) override {
    add(name, model, "part");
  }
  void change_object(std::size_t object, const model::Model& model,
                     std::span<const std::uint32_t> origin) override {
    nodes_.at(object) = model.nodes.size();
    digest_.add_bytes(origin.data(), origin.size_bytes());
  }
  void add_frame(double time, std::span<const formats::FrameObject> objects) override {
    digest_.add(time);
    if (objects.size() != nodes_.size())
      fault = "a frame of " + std::to_string(objects.size()) + " objects";
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (objects[i].displacement.size() != 3 * nodes_.at(i))
        fault = "a frame with another number of nodes";
      digest_.add(objects[i].displacement);
      for (const double u : objects[i].displacement)
        if (!std::isfinite(static_cast<float>(u)))
          fault = "a displacement of " + text::number_text(u);
      for (const contact::NodeVector& f : objects[i].forces) {
        digest_.add(std::uint64_t{f.node});
        digest_.add_bytes(&f.value, sizeof f.value);
        if (f.node >= nodes_[i] || !std::isfinite(static_cast<float>(norm(f.value))))
          fault =
              "a force of " + text::number_text(norm(f.value)) + " at " + std::to_string(f.node);
      }
    }
    ++frames;
  }
  void commit() override {}
  std::string hex() { return digest_.hex(); }

  std::string fault;
  std::size_t frames = 0;

private:
  void add(const std::string& name, const model::Model& model, std::string_view what) {
    nodes_.push_back(model.nodes.size());
    digest_.add_bytes(name.data(), name.size());
    digest_.add_bytes(what.data(), what.size());
    digest_.add(std::uint64_t{frames});
  }
  Digest digest_;
  std::vector<std::size_t> nodes_;
};

inline void stiffen(model::Model& model, double by) {
  for (model::Spring& s : model.springs)
    s.stiffness *= by;
  if (!model.tetrahedra.empty())
    model.materials[0].young *= by;
}

/// Stores of the models, and of a second stage four times as stiff.
inline compliance::StoredStiffness fuzzed_store(const std::string& name, double stiffer) {
  struct Kept {
    linalg::StiffnessMatrix matrix;
    linalg::FactorData data;
    std::vector<std::uint32_t> surface;
  };
  static std::map<std::pair<std::string, double>, std::shared_ptr<Kept>> all;
  std::shared_ptr<Kept>& kept = all[{name, stiffer}];
  if (!kept) {
    model::Model model = fuzzed_models().at(name);
    stiffen(model, stiffer);
    auto made = std::make_shared<Kept>();
    made->matrix = fem::stiffness_matrix(model);
    made->data = linalg::Factor(made->matrix, Context{}).data();
    for (std::uint32_t i = 0; i < model::surface_count(model); i += 2)
      made->surface.push_back(i);
    kept = std::move(made);
  }
  return timing::memory_stiffness(kept->matrix, kept->data, kept->surface, false);
}

struct FuzzedRun {
  std::string replies, answers, fault, digest, result;
  std::uint64_t errors = 0, steps = 0;
  double seconds = 0; ///< of the processor
  bool slow = false;  ///< it took too long and was ended
};

struct FuzzedOptions {
  bool serve = true; ///< lines are acknowledged as well
  int threads = 1;
  std::string record{}; ///< written if it is not empty
  double seconds = 10;
  bool shown = true; ///< there is a result, and with `serve` shapes are shared
  bool measure = true, verify = false;
  double tolerance = 0;
};

inline FuzzedRun run_fuzzed(const std::vector<std::string>& lines, const FuzzedOptions& how) {
  FuzzedRun out;
  const bool serve = how.serve, shares = how.serve && how.shown;
  const auto base = [](const std::string& name) { return name.substr(name.find_last_of('/') + 1); };
  CheckedResult result;
  cli::SceneOptions options;
  options.files.model = [&](const std::string& name) {
    const std::string file = base(name), stiff = ".stiff";
    if (!file.ends_with(stiff))
      return fuzzed_models().at(file);
    model::Model model = fuzzed_models().at(file.substr(0, file.size() - stiff.size()));
    stiffen(model, 4);
    return model;
  };
  options.files.store = [&](const std::string& name, const model::Model&) {
    return fuzzed_store(base(name), 1);
  };
  options.files.second_stage = [&](const std::string& name, const model::Model&) {
    return [file = base(name)] { return compliance::compliance_of_store(fuzzed_store(file, 4)); };
  };
  options.files.instrument = [&](const std::string& name, contact::InstrumentShape shape) {
    const int kind = base(name)[3] - '0';
    TriangleMesh mesh = kind < 3 ? divided_box({8, 4, 0.5 + kind}, 2) : sphere_mesh(1, 5, {});
    if (kind == 4) // dented
      mesh.points[0] *= 0.5;
    shape.core = std::make_shared<const contact::ConvexCore>(mesh);
    if (!(shape.radius > 0))
      shape.radius = shape.core->size() / 100;
    return shape;
  };
  options.files.node_list = [](const std::string&) { return std::string("0 3-5\n"); };
  const std::string shapes = shares ? ScratchFile(".shapes").path() : "";
  DoorCheck door(shapes);
  options.reply = [&](std::string_view text) {
    out.replies += text;
    if (shares)
      door.reply(text);
  };
  options.serve = options.acknowledge = serve;
  const auto shared = shares ? std::make_unique<formats::SharedShapes>(shapes) : nullptr;
  options.shared = shared.get();
  options.measure = how.measure;
  options.measure_error = how.verify;
  options.tolerance = how.tolerance;
  options.result = how.shown ? &result : nullptr;
  options.warn = [](const std::string&) {};
  std::optional<cli::SceneRecord> log;
  if (!how.record.empty())
    options.record = &log.emplace(how.record, formats::Output::Options{}, "-");
  const ScratchFile table(".csv");
  cli::EventLog events(table.path(), formats::Output::Options{.binary = false});
  options.events = &events;
  Context context;
  context.threads = how.threads;
  // Of the processor, for others may be at work.
  const std::clock_t begin = std::clock();
  const auto end = begin + static_cast<std::clock_t>(how.seconds * CLOCKS_PER_SEC);
  std::atomic<unsigned> asked = 0; // that clock is slow to read
  context.cancelled = [&, end] {
    return asked.fetch_add(1, std::memory_order_relaxed) % 32 == 0 && std::clock() > end;
  };
  cli::SceneRun run("fuzz", context, options);
  try {
    for (const std::string& line : lines) {
      if (run.ended())
        break;
      if (line == next_client)
        run.next_client();
      if (shares)
        door.line(line);
      run.line(line);
      if (shares)
        door.line_done();
    }
    if (run.simulation().object_count() > 0) // else each was refused
      run.finish();
  } catch (const Cancelled&) {
    out.slow = true;
  } catch (const std::exception& error) {
    out.fault = std::string("it ended: ") + error.what();
  }
  if (log)
    log->commit();
  if (out.fault.empty())
    out.fault = result.fault.empty() ? door.fault : result.fault;
  out.answers = shares ? door.answers : out.replies;
  out.errors = run.counts().errors;
  out.steps = run.simulation().counts().steps;
  out.seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  out.digest = run.counts().digest;
  out.result = result.hex() + " " + std::to_string(result.frames);
  return out;
}

inline FuzzedRun run_fuzzed(const std::vector<std::string>& lines, bool serve, int threads,
                            const std::string& record, double seconds = 10) {
  return run_fuzzed(lines,
                    {.serve = serve, .threads = threads, .record = record, .seconds = seconds});
}

inline std::vector<std::string> lines_in(std::istream& text) {
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);)
    lines.push_back(line);
  return lines;
}

/// What no line may say, if one says it.
inline std::string said_in(const std::string& replies) {
  std::istringstream text(replies);
  for (const std::string& line : lines_in(text))
    for (const char* word : {"nan", "inf ", "basic_ios", "max_size", "std::", "bad_alloc"})
      if ((" " + line + " ").find(std::string(line.starts_with("error ") ? "" : " ") + word) !=
          std::string::npos)
        return "it says: " + line;
  return "";
}

/// The first line that differs.
inline std::string first_difference(const std::string& right, const std::string& other) {
  std::istringstream a(right), b(other);
  std::string in_a, in_b;
  for (std::size_t number = 1;; ++number) {
    const bool more_a = static_cast<bool>(std::getline(a, in_a)),
               more_b = static_cast<bool>(std::getline(b, in_b));
    if (!more_a && !more_b)
      return "nowhere";
    if (more_a != more_b || in_a != in_b)
      return "line " + std::to_string(number) + " '" + (more_a ? in_a : "") + "', then '" +
             (more_b ? in_b : "") + "'";
  }
}

/// What is wrong with how this scene runs; empty: nothing. \param seen counts steps, errors and
/// scenes that were too slow
struct FuzzedCounts {
  std::uint64_t steps = 0, errors = 0, slow = 0;
};
inline std::string fault_of_scene(const std::vector<std::string>& lines, FuzzedCounts& seen) {
  const ScratchFile record(".scene");
  const FuzzedRun live = run_fuzzed(lines, true, 1, record.path());
  seen.steps += live.steps;
  seen.errors += live.errors;
  if (live.slow) {
    ++seen.slow;
    return "";
  }
  const std::string fault = live.fault.empty() ? said_in(live.replies) : live.fault;
  if (!fault.empty())
    return fault;
  std::ifstream file(record.path());
  const std::vector<std::string> again = lines_in(file);
  if (again.empty())
    return "";
  // A run may take longer than it may where nothing long asks it to stop.
  const FuzzedRun replay = run_fuzzed(again, false, 2, "", 100 + 10 * live.seconds);
  if (!replay.fault.empty() || replay.slow)
    return "the record does not run: " + replay.fault;
  if (replay.answers != live.answers)
    return "the record answers otherwise: " + first_difference(live.answers, replay.answers);
  if (replay.digest != live.digest || replay.result != live.result)
    return "the record gives another result";
  return "";
}

} // namespace gewebe::test
