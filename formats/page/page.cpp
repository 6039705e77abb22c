#include "formats/page/page.h"

#include "formats/page/packing.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

/// viewer.html and viewer.js, which the build turns into strings.
extern "C" const char gewebe_viewer_html[];
extern "C" const char gewebe_viewer_js[];

namespace gewebe::formats {
namespace {

using Json = nlohmann::ordered_json;

Json triple(const Vec3& v) {
  return {v.x, v.y, v.z};
}

/// Elements that hold the packed numbers, and their names.
struct Blocks {
  std::string text;
  std::size_t count = 0;

  std::string add(const std::string& packed) {
    std::string name = "n" + std::to_string(count++);
    text += "<script type=\"text/plain\" id=\"" + name + "\">" + packed + "</script>\n";
    return name;
  }
};

Json field_json(const ShownField& field, const std::array<double, 2>* stored) {
  Json json{{"name", field.name},
            {"unit", field.unit},
            {"least", field.least},
            {"greatest", field.greatest},
            {"stored", stored != nullptr}};
  if (stored != nullptr) {
    json["low"] = (*stored)[0];
    json["high"] = (*stored)[1];
  }
  return json;
}

/// The least and the greatest stored value.
std::array<double, 2> stored_range(const ShownScene& scene) {
  std::array<double, 2> range{0, 0};
  bool any = false;
  for (const ShownPart& part : scene.parts)
    for (const std::vector<double>& values : part.values)
      for (const double value : values) {
        range = any ? std::array{std::min(range[0], value), std::max(range[1], value)}
                    : std::array{value, value};
        any = true;
      }
  return range;
}

Json part_json(const ShownPart& part, const std::array<double, 2>& range, Blocks& blocks) {
  Box3 box;
  for (const Vec3& p : part.rest)
    box.add(p);
  for (const std::vector<Vec3>& points : part.points)
    for (const Vec3& p : points)
      box.add(p);
  const PlaceGrid grid = place_grid(box);
  std::vector<std::vector<std::uint16_t>> rows{quantised(part.rest, grid)};
  for (const std::vector<Vec3>& points : part.points)
    rows.push_back(quantised(points, grid));
  Json paints = Json::array();
  for (const ShownPaint& paint : part.paints)
    paints.push_back({{"triangles", paint.triangles}, {"color", triple(paint.color)}});
  Json json{{"name", part.name},
            {"instrument", part.instrument},
            {"first", part.first},
            {"frames", part.points.size()},
            {"points", part.rest.size()},
            {"triangles", part.triangles.size()},
            {"paints", paints},
            {"origin", triple(grid.origin)},
            {"step", grid.step},
            {"corners", blocks.add(packed_corners(part.triangles))},
            {"places", blocks.add(packed_rows(rows, 3))}};
  const auto has = [](const std::vector<double>& values) { return !values.empty(); };
  if (std::ranges::any_of(part.values, has)) {
    rows.clear();
    for (const std::vector<double>& values : part.values)
      rows.push_back(values.empty() ? std::vector<std::uint16_t>(part.rest.size(), no_value)
                                    : quantised(values, range[0], range[1]));
    json["values"] = blocks.add(packed_rows(rows, 1));
  }
  return json;
}

Json view_json(const ShownView& view) {
  Json json{{"eye", triple(view.eye)},
            {"target", triple(view.target)},
            {"up", triple(view.up)},
            {"fov", view.fov}};
  return json;
}

/// Adds instruments and the greatest force, in N.
void add_instruments(Json& json, const ShownScene& scene) {
  double greatest = 0;
  Json all = Json::array();
  for (const ShownInstrument& instrument : scene.instruments) {
    Json places = Json::array(), forces = Json::array();
    for (const auto& there : instrument.place_and_force) {
      places.push_back(there ? triple((*there)[0]) : Json());
      forces.push_back(there ? triple((*there)[1]) : Json());
      if (there)
        greatest = std::max(greatest, norm((*there)[1]));
    }
    all.push_back({{"name", instrument.name}, {"place", places}, {"force", forces}});
  }
  json["instruments"] = std::move(all);
  json["greatestForce"] = greatest > 0 ? greatest : 1;
}

Json curves_json(const ShownScene& scene) {
  Json all = Json::array();
  for (const ShownCurve& curve : scene.curves) {
    Json values = Json::array();
    for (const std::optional<double>& value : curve.values)
      values.push_back(value ? Json(*value) : Json());
    all.push_back({{"name", curve.name}, {"unit", curve.unit}, {"values", values}});
  }
  return all;
}

Json scene_json(const ShownScene& scene, Blocks& blocks) {
  const ShownView& view = scene.view;
  Json json{{"title", scene.title},
            {"times", scene.times},
            {"box", {triple(scene.box.min), triple(scene.box.max)}},
            {"camera", view_json(view)},
            {"background", triple(view.background)},
            {"light", view.endoscope ? "endoscope" : "camera"}};
  json["reach"] = view.reach ? Json(*view.reach) : Json();
  json["clip"] = Json();
  if (view.clip)
    json["clip"] = {{"point", triple((*view.clip)[0])}, {"normal", triple((*view.clip)[1])}};
  const std::array<double, 2> range = stored_range(scene);
  json["fields"] = Json::array();
  json["field"] = -1;
  const auto add_field = [&](const ShownField& field, const std::array<double, 2>* stored) {
    if (field.name == view.field)
      json["field"] = json["fields"].size();
    json["fields"].push_back(field_json(field, stored));
  };
  if (scene.displacement)
    add_field(*scene.displacement, nullptr);
  if (scene.stored)
    add_field(*scene.stored, &range);
  json["ramp"] = Json::array();
  for (const std::array<std::uint8_t, 3>& color : scene.ramp)
    for (const std::uint8_t channel : color)
      json["ramp"].push_back(channel);
  json["parts"] = Json::array();
  for (const ShownPart& part : scene.parts)
    json["parts"].push_back(part_json(part, range, blocks));
  add_instruments(json, scene);
  json["curves"] = curves_json(scene);
  return json;
}

/// Within an element of HTML a text ends at "</": "<" stands in strings alone.
std::string embedded(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text)
    if (c == '<')
      safe += "\\u003c";
    else
      safe += c;
  return safe;
}

} // namespace

double scene_bytes(const ShownScene& scene) {
  double bytes = 0;
  for (const ShownPart& part : scene.parts) {
    const auto points = static_cast<double>(part.rest.size());
    const auto frames = static_cast<double>(part.points.size());
    bytes += points * (frames + 1) * sizeof(Vec3) +
             static_cast<double>(part.triangles.size()) * sizeof(Triangle) +
             points * static_cast<double>(part.values.size()) * sizeof(double);
  }
  return bytes;
}

std::uint64_t write_page(Output& output, const ShownScene& scene) {
  Blocks blocks;
  const std::string json = embedded(scene_json(scene, blocks));
  std::uint64_t size = 0;
  for (const std::string_view text :
       {std::string_view(gewebe_viewer_html),
        std::string_view("<script type=\"application/json\" id=\"scene\">"), std::string_view(json),
        std::string_view("</script>\n"), std::string_view(blocks.text),
        std::string_view("<script>\n"), std::string_view(gewebe_viewer_js),
        std::string_view("</script>\n</body>\n</html>\n")}) {
    output.write(text);
    size += text.size();
  }
  return size;
}

} // namespace gewebe::formats
