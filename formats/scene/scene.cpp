#include "formats/scene/scene.h"

#include "base/error.h"
#include "formats/scene/verbs_internal.h"
#include "formats/scene/words.h"
#include "integrator/solid_motion.h"
#include "text/nearest_word.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

/// RATIO@HZ: what a motion of this frequency decays by.
double parse_damping(Words& in, std::string_view text) {
  const std::size_t at = text.find('@');
  if (at == std::string_view::npos)
    in.fail("a damping without a frequency");
  const double ratio = in.number_in(text.substr(0, at), "damping ratio"),
               frequency = in.number_in(text.substr(at + 1), "frequency");
  if (!(ratio >= 0) || !(frequency > 0))
    in.fail("a damping ratio below 0, or a frequency that is not positive");
  const double damping = integrator::damping_per_stiffness(ratio, frequency);
  if (!std::isfinite(damping))
    in.fail("a damping that is not finite");
  return damping;
}

double parse_tolerance(Words& in, std::string_view text) {
  const double tolerance = in.number_in(text, "tolerance");
  if (!(tolerance >= 1e-9 && tolerance <= 0.1))
    in.fail("a tolerance that is not from 1e-9 to 0.1");
  return tolerance;
}

double parse_bulk(Words& in, std::string_view text) {
  const double bulk = in.number_in(text, "bulk modulus");
  if (!(bulk > 0 && bulk <= 1e12))
    in.fail("a bulk modulus that is not above 0 and up to 1e12 Pa");
  return bulk;
}

What parse_object(Words& in) {
  ObjectCommand c;
  c.name = in.name();
  c.model = in.word("model");
  if (c.model.empty())
    in.fail("an empty file name");
  std::optional<scene::Method> method;
  while (!in.done()) {
    const std::string word = in.word("");
    if (word.starts_with("store=") && word.size() > 6 && c.store.empty())
      c.store = word.substr(6);
    else if ((word == "integration=implicit" || word == "integration=auto") &&
             c.integration == scene::Integration::semi_implicit)
      c.integration = word == "integration=implicit" ? scene::Integration::implicit
                                                     : scene::Integration::automatic;
    else if (word == "rotation=warp" && !c.warp)
      c.warp = true;
    else if ((word == "law=corotational" || word == "law=neo-hookean") && !c.solid.law)
      c.solid.law = word == "law=corotational" ? integrator::SolidLaw::corotational
                                               : integrator::SolidLaw::hyperelastic;
    else if (word.starts_with("damping=") && !c.solid.damping)
      c.solid.damping = parse_damping(in, std::string_view(word).substr(8));
    else if (word.starts_with("bulk=") && !c.solid.bulk)
      c.solid.bulk = parse_bulk(in, std::string_view(word).substr(5));
    else if (word.starts_with("tolerance=") && !c.solid.tolerance)
      c.solid.tolerance = parse_tolerance(in, std::string_view(word).substr(10));
    else if ((word == "method=ffe" || word == "method=ela") && !method)
      method = word == "method=ffe" ? scene::Method::ffe : scene::Method::ela;
    else
      in.fail(shown(word) + " is no use here");
  }
  c.method = method.value_or(c.store.empty() ? scene::Method::ela : scene::Method::ffe);
  if (c.solid.bulk && c.method == scene::Method::ffe)
    in.fail("bulk= with method=ffe");
  if (c.warp && c.method == scene::Method::ela)
    in.fail("rotation=warp with method=ela");
  return c;
}

/// Subject of a change: an object and its nodes.
ChangeCommand parse_about(Words& in, scene::Change change) {
  ChangeCommand c{.change = std::move(change)};
  c.object = in.name();
  c.nodes = in.nodes();
  return c;
}

What parse_force(Words& in) {
  ChangeCommand c = parse_about(in, {});
  scene::SetForce set;
  set.force = in.vector("number");
  c.total = in.take("total");
  set.period = in.time_after("period");
  c.change = set;
  return c;
}

What parse_pressure(Words& in) {
  ChangeCommand c = parse_about(in, {});
  scene::SetPressure set;
  set.pressure.pressure = in.number("number");
  set.pressure.period = in.time_after("period");
  c.change = set;
  return c;
}

What parse_mass(Words& in) {
  ChangeCommand c = parse_about(in, {});
  scene::SetMass set;
  set.mass = in.number("mass");
  if (!(set.mass >= 0))
    in.fail("a negative mass");
  c.total = !in.take("each");
  c.change = set;
  return c;
}

What parse_attach(Words& in) {
  ChangeCommand c = parse_about(in, {});
  c.other = in.name();
  c.others = in.nodes();
  scene::Attach tie;
  tie.stiffness = in.number("stiffness");
  if (!(tie.stiffness > 0))
    in.fail("a stiffness that is not positive");
  c.change = tie;
  return c;
}

What parse_contact(Words& in) {
  ChangeCommand c;
  c.object = in.name();
  c.other = in.name();
  scene::SetContact set;
  set.separate = in.take("separate");
  if (in.take("friction"))
    set.friction = in.number("coefficient");
  if (!(set.friction >= 0))
    in.fail("a negative coefficient of friction");
  c.change = set;
  return c;
}

What parse_displace(Words& in) {
  ChangeCommand c = parse_about(in, {});
  scene::SetDisplacement set;
  set.displacement = in.vector("number");
  set.duration = in.time_after("over");
  c.change = set;
  return c;
}

What parse_release(Words& in) {
  return parse_about(in, scene::Release{});
}

/// A quaternion, or the degrees of a turn about an axis.
std::optional<contact::Quaternion> parse_turn(Words& in) {
  if (in.take("turn")) {
    const Vec3 axis = in.vector("number");
    const double degrees = in.number("angle");
    if (axis == Vec3{})
      in.fail("an axis without direction");
    return contact::turn_about(axis, degrees);
  }
  if (!in.take("quaternion"))
    return std::nullopt;
  contact::Quaternion q;
  for (double* const part : {&q.w, &q.x, &q.y, &q.z})
    *part = in.number("number");
  if (q == contact::Quaternion{0, 0, 0, 0})
    in.fail("a quaternion of length 0");
  return contact::unit(q);
}

/// Its friction, which all but blades may have.
void parse_friction(Words& in, contact::InstrumentShape& shape) {
  if (!shape.blade && in.take("friction"))
    shape.friction = in.number("friction");
  if (!(shape.friction >= 0))
    in.fail("a negative friction");
}

/// The rest of a mesh's line; its radius stays 0 where none is said.
What parse_mesh(Words& in, scene::SetInstrument set) {
  ChangeCommand c;
  c.instrument = set.name;
  c.mesh = in.word("file");
  set.shape.radius = 0;
  if (std::optional<std::string> radius = in.take_after("radius=")) {
    set.shape.radius = in.number_in(*radius, "radius");
    if (!(set.shape.radius > 0))
      in.fail("a radius that is not positive");
  }
  set.pose.place = in.vector("number");
  set.pose.turn = parse_turn(in).value_or(contact::Quaternion{});
  parse_friction(in, set.shape);
  c.change = std::move(set);
  return c;
}

What parse_instrument(Words& in) {
  scene::SetInstrument set;
  set.name = in.name();
  const std::string& kind = in.word("shape");
  if (kind == "mesh")
    return parse_mesh(in, std::move(set));
  if (kind != "blade" && kind != "sphere" && kind != "capsule")
    in.fail(shown(kind) + " is no shape");
  set.shape.blade = kind == "blade";
  set.shape.radius = 0;
  if (!set.shape.blade) {
    set.shape.radius = in.number("radius");
    if (!(set.shape.radius > 0))
      in.fail("a radius that is not positive");
  }
  set.pose.place = in.vector("number");
  if (kind != "sphere")
    set.shape.axis = in.vector("number") - set.pose.place;
  if (set.shape.blade && set.shape.axis == Vec3{})
    in.fail("an edge without length");
  parse_friction(in, set.shape);
  std::string name = set.name;
  return ChangeCommand{.change = std::move(set), .instrument = std::move(name)};
}

What parse_move(Words& in) {
  ChangeCommand c;
  c.instrument = in.name();
  scene::MoveInstrument move;
  move.place = in.vector("number");
  move.turn = parse_turn(in);
  move.duration = in.time_after("over");
  c.change = move;
  return c;
}

What parse_couple(Words& in) {
  ChangeCommand c;
  c.instrument = in.name();
  scene::SetCoupling set;
  if (!in.take("off")) {
    contact::Coupling coupling;
    coupling.stiffness = in.number("stiffness");
    if (!(coupling.stiffness > 0))
      in.fail("a stiffness that is not positive");
    if (!in.done())
      coupling.damping = in.number("damping");
    if (!(coupling.damping >= 0))
      in.fail("a negative damping");
    set.coupling = coupling;
  }
  c.change = set;
  return c;
}

What parse_grasp(Words& in) {
  ChangeCommand c = parse_about(in, scene::Grasp{});
  c.instrument = in.name();
  return c;
}

What parse_withdraw(Words& in) {
  return ChangeCommand{.change = scene::Withdraw{}, .instrument = in.name()};
}

What parse_gravity(Words& in) {
  return ChangeCommand{.change = scene::SetGravity{in.vector("number")}};
}

What parse_timestep(Words& in) {
  scene::SetTimestep c{in.number("time")};
  if (!(c.dt > 0))
    in.fail("a timestep that is not positive");
  if (in.done())
    return ChangeCommand{.change = c};
  if (const std::string& word = in.word("order=1 or order=2"); word == "order=2")
    c.order = 2;
  else if (word != "order=1")
    in.fail(shown(word) + " is no order");
  return ChangeCommand{.change = c};
}

What parse_two_step(Words& in) {
  ChangeCommand c;
  c.object = in.name();
  scene::SetTwoStep set;
  set.options.threshold = in.number("force");
  if (!(set.options.threshold > 0))
    in.fail("a threshold that is not positive");
  set.options.series = in.take("series");
  c.change = set;
  if (in.done())
    return c;
  const std::string word = in.word("");
  if (!word.starts_with("stage=") || word.size() == 6)
    in.fail(shown(word) + " is no use here");
  c.stage = word.substr(6);
  return c;
}

What parse_method(Words& in) {
  ChangeCommand c;
  c.object = in.name();
  const std::string& word = in.word("method");
  if (word != "ffe" && word != "ela")
    in.fail(shown(word) + " is no method");
  c.change = scene::SetMethod{0, word == "ffe" ? scene::Method::ffe : scene::Method::ela};
  return c;
}

What parse_cut(Words& in) {
  ChangeCommand c;
  c.object = in.name();
  const std::string& kind = in.word("'springs' or 'plane'");
  if (kind == "plane") {
    scene::PlaneToCut what;
    what.plane.point = in.vector("number");
    what.plane.normal = in.vector("number");
    const double size = norm(what.plane.normal);
    if (!(size > 0 && std::isfinite(size)))
      in.fail("a normal without direction");
    what.along_faces = in.take("along=faces");
    if (!what.along_faces && !in.done()) {
      c.nodes = in.nodes();
      what.along_faces = in.take("along=faces");
    }
    c.change = scene::CutObject{0, what};
  } else if (kind == "springs") {
    c.nodes = in.nodes();
    if (!in.done())
      c.others = in.nodes();
    c.change = scene::CutObject{};
  } else {
    in.fail(shown(kind) + " can't be cut");
  }
  return c;
}

What parse_tear(Words& in) {
  ChangeCommand c;
  c.object = in.name();
  scene::SetTear set;
  std::optional<std::string> of = in.take_after("strain=");
  if (!of) {
    of = in.take_after("stress=");
    set.limit.stress = of.has_value();
  }
  if (!of) {
    set.strain = in.number("strain");
    if (!(set.strain >= 0))
      in.fail("a negative strain");
  } else {
    for (const char* const what = set.limit.stress ? "stress" : "strain"; of;) {
      const std::size_t comma = of->find(',');
      const double most = in.number_in(std::string_view(*of).substr(0, comma), what);
      if (!(most >= 0))
        in.fail(std::string("a negative ") + what);
      set.limit.most.push_back(most);
      of = comma == std::string::npos ? std::nullopt : std::optional(of->substr(comma + 1));
    }
    if (const auto over = in.take_after("over=")) {
      set.limit.over = in.number_in(*over, "length");
      if (!(set.limit.over > 0))
        in.fail("no length to take means over");
    }
  }
  c.change = set;
  return c;
}

What parse_restore(Words& in) {
  return ChangeCommand{.change = scene::Restore{}, .object = in.name()};
}

What parse_prepare(Words& in) {
  ChangeCommand c;
  c.object = in.name();
  scene::Prepare prepare;
  if (in.take("contact")) {
    prepare.cut = false;
    if (!in.done())
      c.nodes = in.nodes();
  } else if (!in.done()) {
    if (!in.take("cut"))
      in.fail(shown(in.word("")) + " is nothing to prepare");
    prepare.contact = false;
  }
  c.change = prepare;
  return c;
}

struct Verb {
  std::string_view name;
  const char* usage;
  bool at; ///< may stand behind `at T`
  std::function<What(Words&)> parse;
};

const std::array<Verb, 30>& verbs() {
  static const std::array<Verb, 30> all{{
      {"object",
       "object NAME MODEL.ela [store=FILE.h5] [method=ffe|ela] [integration=implicit|auto] "
       "[rotation=warp] [law=corotational|neo-hookean] [damping=RATIO@HZ] [tolerance=E] "
       "[bulk=K]",
       false, parse_object},
      {"force", "force NAME NODES fx fy fz [total] [period T]", true, parse_force},
      {"pressure", "pressure NAME NODES p [period T]", true, parse_pressure},
      {"mass", "mass NAME NODES m [each], m 0 or more", true, parse_mass},
      {"displace", "displace NAME NODES dx dy dz [over T]", true, parse_displace},
      {"attach", "attach A NODES B NODES k, k positive", true, parse_attach},
      {"contact",
       "contact A B [separate] [friction MU] or contact A self [separate] [friction MU], MU 0 or "
       "more",
       true, parse_contact},
      {"release", "release NAME NODES", true, parse_release},
      {"instrument",
       "instrument NAME sphere R x y z [friction MU], instrument NAME capsule R x y z x y z "
       "[friction MU], instrument NAME mesh FILE [radius=R] x y z [turn ax ay az DEGREES|"
       "quaternion w x y z] [friction MU] or instrument NAME blade x y z x y z",
       true, parse_instrument},
      {"move", "move NAME x y z [turn ax ay az DEGREES|quaternion w x y z] [over T]", true,
       parse_move},
      {"couple", "couple NAME K [D], K positive, D 0 or more, or couple NAME off", true,
       parse_couple},
      {"grasp", "grasp NAME NODES INSTRUMENT", true, parse_grasp},
      {"withdraw", "withdraw NAME", true, parse_withdraw},
      {"cut",
       "cut NAME springs NODES [NODES] or cut NAME plane px py pz nx ny nz [NODES] [along=faces]",
       true, parse_cut},
      {"tear",
       "tear NAME STRAIN, 0 or more, or of a solid tear NAME stress=PA[,PA "
       "...]|strain=STRAIN[,...] "
       "[over=MM]",
       true, parse_tear},
      {"restore", "restore NAME", true, parse_restore},
      {"gravity", "gravity gx gy gz", true, parse_gravity},
      {"method", "method NAME ffe|ela", true, parse_method},
      {"timestep", "timestep dt [order=1|order=2]", true, parse_timestep},
      {"two-step", "two-step NAME f0 [series] [stage=FILE.ela], f0 positive", true, parse_two_step},
      {"emit",
       "emit shapes|surfaces|forces|instruments, emit stress NAME [NODES], or emit model NAME FILE",
       true, parse_emit},
      {"step", "step [dt], dt 0 or more", false, parse_step},
      {"run", "run UNTIL every DT", false, parse_run},
      {"prepare", "prepare NAME [contact [NODES]|cut]", false, parse_prepare},
      {"sync", "sync", false, parse_sync},
      {"end", "end", false, parse_end},
      {"nodes", "nodes NAME [rest|positions]", false, parse_nodes},
      {"select", "select NAME NODES", false, parse_select},
      {"objects", "objects", false, parse_objects},
      {"instruments", "instruments", false, parse_instruments},
  }};
  return all;
}

std::string verb_list(bool at_only) {
  std::string list;
  for (const Verb& verb : verbs())
    if (verb.at || !at_only)
      list += (list.empty() ? "" : ", ") + std::string(verb.name);
  return at_only ? list : list + ", at";
}

/// \param line all words, the command's own first
What parse_command(std::vector<std::string> line, bool behind_at) {
  const std::string verb_name = line[0];
  for (const Verb& verb : verbs())
    if (verb.name == verb_name && (verb.at || !behind_at)) {
      line.erase(line.begin());
      Words in(std::move(line), verb.usage);
      What what = verb.parse(in);
      in.end();
      return what;
    }
  std::vector<std::string> known;
  for (const Verb& verb : verbs())
    if (verb.at || !behind_at)
      known.emplace_back(verb.name);
  throw Error(shown(verb_name) + " is no command" + (behind_at ? " behind at T" : "") +
              gewebe::text::suggestion(verb_name, known) + ", expected one of " +
              verb_list(behind_at));
}

} // namespace

std::vector<std::string> scene_words(std::string_view line) {
  std::vector<std::string> words;
  for (std::size_t at = 0; at < line.size();) {
    if (is_blank(line[at])) {
      ++at;
      continue;
    }
    if (line[at] == '#')
      break;
    std::string& word = words.emplace_back();
    while (at < line.size() && !is_blank(line[at]) && line[at] != '#') {
      if (line[at] != '"') {
        word += line[at++];
        continue;
      }
      const std::size_t close = line.find('"', at + 1);
      if (close == std::string_view::npos)
        throw Error("a quote without an end, expected one more '\"'");
      word += line.substr(at + 1, close - at - 1);
      at = close + 1;
    }
    if (word.find('\0') != std::string::npos)
      throw Error("a zero byte, expected text");
  }
  return words;
}

std::string scene_line(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) {
    const bool quoted = word.empty() || std::any_of(word.begin(), word.end(),
                                                    [](char c) { return is_blank(c) || c == '#'; });
    line += (line.empty() ? "" : " ") + (quoted ? '"' + word + '"' : word);
  }
  return line;
}

std::optional<Command> parse_scene_line(std::string_view line) {
  std::vector<std::string> words = scene_words(line);
  if (words.empty())
    return std::nullopt;
  Command command;
  if (words[0] == "at") {
    words.erase(words.begin());
    Words in(words, "at [every] T COMMAND...");
    command.every = in.take("every");
    command.at = in.number("time");
    if (command.every && !(*command.at > 0))
      in.fail("a period that is not positive");
    if (in.done())
      in.fail("no command");
    words.erase(words.begin(), words.begin() + (command.every ? 2 : 1));
  }
  command.what = parse_command(std::move(words), command.at.has_value());
  const bool model = std::holds_alternative<EmitModelCommand>(command.what);
  if (command.at && (model || std::holds_alternative<EmitStressCommand>(command.what)))
    throw Error(std::string("emit ") + (model ? "model" : "stress") +
                " behind at T, expected it between steps");
  return command;
}

} // namespace gewebe::formats
