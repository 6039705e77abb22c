#include "formats/scene/measurements.h"

#include "base/error.h"
#include "formats/scene/scene.h"
#include "formats/scene/words.h"
#include "text/nearest_word.h"

#include <algorithm>
#include <array>

namespace gewebe::formats {

namespace {

constexpr std::array<const char*, 6> usages{"gravity gx gy gz",
                                            "force NODES fx fy fz [total]",
                                            "measure x y z dx dy dz, '-' for an axis not measured",
                                            "case",
                                            "known MATERIAL",
                                            "swing TIME VALUE"};

std::string verb_of(const char* usage) {
  const std::string_view text = usage;
  return std::string(text.substr(0, text.find(' ')));
}

fit::Measurement parse_measure(Words& in, const std::string& name) {
  fit::Measurement m;
  m.place = in.vector("number");
  bool any = false;
  for (auto& d : m.displacement)
    if (!in.take("-")) {
      d = in.number("number");
      any = true;
    }
  if (!any)
    in.fail("no axis measured");
  m.name = name;
  return m;
}

void parse_line(Words& in, const std::string& verb, const std::string& place, Measurements& all) {
  LoadCase& now = all.cases.back();
  if (verb == "gravity")
    now.gravity = in.vector("number");
  else if (verb == "force")
    now.forces.push_back({in.nodes(), in.vector("number"), in.take("total")});
  else if (verb == "measure")
    now.measurements.push_back(parse_measure(in, place));
  else if (verb == "case")
    all.cases.emplace_back();
  else if (verb == "known")
    all.known.push_back(in.word("MATERIAL"));
  else {
    all.times.push_back(in.number("time"));
    all.values.push_back(in.number("number"));
  }
  in.end();
}

} // namespace

Measurements parse_measurements(std::string_view text, const std::string& name) {
  Measurements all;
  all.cases.emplace_back();
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string place = name + ":" + std::to_string(number);
    gewebe::at(place, [&] {
      std::vector<std::string> words = scene_words(line);
      if (words.empty())
        return;
      const std::string verb = words[0];
      const auto usage =
          std::ranges::find_if(usages, [&](const char* one) { return verb_of(one) == verb; });
      if (usage == usages.end()) {
        std::vector<std::string> verbs;
        std::string list;
        for (const char* one : usages) {
          verbs.push_back(verb_of(one));
          list += (list.empty() ? "" : ", ") + verbs.back();
        }
        throw Error(shown(verb) + " is no word of measurements" +
                    gewebe::text::suggestion(verb, verbs) + ", expected one of " + list);
      }
      words.erase(words.begin());
      Words in(std::move(words), *usage);
      parse_line(in, verb, place, all);
    });
  }
  std::erase_if(all.cases, [](const LoadCase& c) { return c.measurements.empty(); });
  if (all.cases.empty() && all.times.empty())
    throw Error(name, "no measurement, expected lines of 'measure' or 'swing'");
  return all;
}

} // namespace gewebe::formats
