#include "formats/page/glb.h"

#include "base/error.h"
#include "numeric/power.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::formats {
namespace {

using Json = nlohmann::ordered_json;
using Float3 = std::array<float, 3>;

enum Target : int { array_buffer = 34962, element_array_buffer = 34963, no_target = 0 };
constexpr int float32 = 5126, uint32 = 5125;
constexpr double fps = 25;

/// The arrays of the file with their accessors.
struct Arrays {
  std::string bytes;
  Json views = Json::array(), accessors = Json::array();

  std::size_t view(const void* data, std::size_t size, Target target) {
    Json view{{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", size}};
    if (target != no_target)
      view["target"] = static_cast<int>(target);
    bytes.append(static_cast<const char*>(data), size);
    views.push_back(std::move(view));
    return views.size() - 1;
  }
  std::size_t accessor(Json description) {
    accessors.push_back(std::move(description));
    return accessors.size() - 1;
  }
  /// \param bounds  states the least and greatest numbers, as POSITION needs
  std::size_t vectors(const std::vector<Float3>& values, bool bounds) {
    const std::size_t at = view(values.data(), values.size() * sizeof(Float3), array_buffer);
    Json description{
        {"bufferView", at}, {"componentType", float32}, {"count", values.size()}, {"type", "VEC3"}};
    if (bounds) {
      Float3 least = values.front(), greatest = least;
      for (const Float3& value : values)
        for (std::size_t k = 0; k < 3; ++k) {
          least[k] = std::min(least[k], value[k]);
          greatest[k] = std::max(greatest[k], value[k]);
        }
      description["min"] = least;
      description["max"] = greatest;
    }
    return accessor(std::move(description));
  }
  std::size_t scalars(const std::vector<float>& values, bool bounds) {
    Json description{{"bufferView", view(values.data(), values.size() * sizeof(float), no_target)},
                     {"componentType", float32},
                     {"count", values.size()},
                     {"type", "SCALAR"}};
    if (bounds) {
      description["min"] = {values.front()};
      description["max"] = {values.back()};
    }
    return accessor(std::move(description));
  }
};

Float3 single(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

Float3 difference(const Float3& a, const Float3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// From values of picture files (sRGB), 0 … 1.
double linear(double value) {
  return value <= 0.04045 ? value / 12.92 : numeric::power((value + 0.055) / 1.055, 2.4);
}

/// Unit normals of points, means of faces by area; z where there is none.
std::vector<Float3> normals_of(std::span<const Vec3> points, std::span<const Triangle> triangles) {
  std::vector<Vec3> sums(points.size());
  for (const auto& [a, b, c] : triangles) {
    const Vec3 n = cross(points[b] - points[a], points[c] - points[a]);
    for (const std::uint32_t corner : {a, b, c})
      sums[corner] += n;
  }
  std::vector<Float3> normals;
  normals.reserve(sums.size());
  for (const Vec3& sum : sums) {
    const double length = norm(sum);
    normals.push_back(length > 0 ? single(sum / length) : Float3{0, 0, 1});
  }
  return normals;
}

/// What a part shows in a frame.
struct FrameArrays {
  std::vector<Float3> points, normals, colors; ///< colours where a field is shown
};

class GlbMaker {
public:
  explicit GlbMaker(const ShownScene& scene)
      : scene_(scene), times_(animation_times(scene.times)),
        stored_(scene.stored && scene.stored->name == scene.view.field),
        displaced_(scene.displacement && scene.displacement->name == scene.view.field) {
    for (const auto& color : scene.ramp)
      ramp_.push_back({static_cast<float>(linear(color[0] / 255.0)),
                       static_cast<float>(linear(color[1] / 255.0)),
                       static_cast<float>(linear(color[2] / 255.0))});
  }

  /// JSON and binary chunk.
  std::pair<Json, std::string> made() {
    for (const ShownPart& part : scene_.parts)
      if (!part.triangles.empty())
        add_part(part);
    constexpr double half = 0.7071067811865476;
    Json root{{"name", scene_.title},
              {"rotation", {-half, 0.0, 0.0, half}},
              {"scale", {0.001, 0.001, 0.001}}};
    if (!nodes_.empty())
      root["children"] = Json::array();
    for (std::size_t n = 0; n < nodes_.size(); ++n)
      root["children"].push_back(n);
    nodes_.push_back(std::move(root));
    Json json{{"asset", {{"version", "2.0"}, {"generator", "Gewebe emboss-render"}}},
              {"scene", 0},
              {"scenes", {{{"nodes", {nodes_.size() - 1}}}}},
              {"nodes", nodes_}};
    if (!meshes_.empty()) {
      json["meshes"] = meshes_;
      json["materials"] = materials_;
      json["accessors"] = arrays_.accessors;
      json["bufferViews"] = arrays_.views;
      json["buffers"] = {{{"byteLength", arrays_.bytes.size()}}};
    }
    if (!channels_.empty())
      json["animations"] = {{{"name", "frames"}, {"channels", channels_}, {"samplers", samplers_}}};
    return {std::move(json), std::move(arrays_.bytes)};
  }

private:
  bool colored(const ShownPart& part) const { return !part.instrument && (stored_ || displaced_); }

  Float3 field_color(double value, const ShownField& field) const {
    const double share =
        std::clamp((value - field.least) / (field.greatest - field.least), 0.0, 1.0);
    return ramp_[static_cast<std::size_t>(
        std::floor(share * static_cast<double>(ramp_.size() - 1) + 0.5))];
  }

  FrameArrays frame_arrays(const ShownPart& part, std::size_t frame) const {
    FrameArrays arrays;
    const std::vector<Vec3>& points = part.points[frame];
    for (const Vec3& p : points)
      arrays.points.push_back(single(p));
    arrays.normals = normals_of(points, part.triangles);
    if (!colored(part))
      return arrays;
    const std::vector<double>& values = part.values[frame];
    for (std::size_t i = 0; i < points.size(); ++i)
      if (displaced_)
        arrays.colors.push_back(field_color(norm(points[i] - part.rest[i]), *scene_.displacement));
      else
        arrays.colors.push_back(values.empty() ? Float3{0.32F, 0.32F, 0.32F}
                                               : field_color(values[i], *scene_.stored));
    return arrays;
  }

  std::size_t material(const Vec3& color) {
    const Json factor{linear(color.x), linear(color.y), linear(color.z), 1.0};
    for (std::size_t n = 0; n < materials_.size(); ++n)
      if (materials_[n]["pbrMetallicRoughness"]["baseColorFactor"] == factor)
        return n;
    materials_.push_back(
        {{"pbrMetallicRoughness",
          {{"baseColorFactor", factor}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.6}}},
         {"doubleSided", true}});
    return materials_.size() - 1;
  }

  Json attributes(const FrameArrays& arrays) {
    Json json{{"POSITION", arrays_.vectors(arrays.points, true)},
              {"NORMAL", arrays_.vectors(arrays.normals, false)}};
    if (!arrays.colors.empty())
      json["COLOR_0"] = arrays_.vectors(arrays.colors, false);
    return json;
  }

  void add_part(const ShownPart& part) {
    const FrameArrays first = frame_arrays(part, 0);
    const Json base = attributes(first);
    Json targets = Json::array();
    std::vector<int> target_of{-1}; // by frame, -1: the base
    for (std::size_t f = 1; f < part.points.size(); ++f) {
      if (part.points[f] == part.points[f - 1] && part.values[f] == part.values[f - 1]) {
        target_of.push_back(target_of.back());
        continue;
      }
      FrameArrays now = frame_arrays(part, f);
      for (std::size_t i = 0; i < now.points.size(); ++i) {
        now.points[i] = difference(now.points[i], first.points[i]);
        now.normals[i] = difference(now.normals[i], first.normals[i]);
        if (!now.colors.empty())
          now.colors[i] = difference(now.colors[i], first.colors[i]);
      }
      target_of.push_back(static_cast<int>(targets.size()));
      targets.push_back(attributes(now));
    }
    Json mesh{{"name", part.name}, {"primitives", primitives(part, base, targets)}};
    if (!targets.empty())
      mesh["weights"] = std::vector<double>(targets.size(), 0.0);
    meshes_.push_back(std::move(mesh));
    nodes_.push_back({{"name", part.name}, {"mesh", meshes_.size() - 1}});
    if (!targets.empty())
      animate_weights(part, target_of, targets.size());
    if (part.points.size() < scene_.times.size())
      animate_presence(part);
  }

  Json primitives(const ShownPart& part, const Json& base, const Json& targets) {
    const std::size_t view = arrays_.view(
        part.triangles.data(), part.triangles.size() * sizeof(Triangle), element_array_buffer);
    Json all = Json::array();
    std::size_t first = 0;
    for (const ShownPaint& paint : part.paints) {
      const std::size_t indices = arrays_.accessor({{"bufferView", view},
                                                    {"byteOffset", first * sizeof(Triangle)},
                                                    {"componentType", uint32},
                                                    {"count", 3 * paint.triangles},
                                                    {"type", "SCALAR"}});
      Json primitive{{"attributes", base},
                     {"indices", indices},
                     {"material", material(colored(part) ? Vec3{1, 1, 1} : paint.color)}};
      if (!targets.empty())
        primitive["targets"] = targets;
      all.push_back(std::move(primitive));
      first += paint.triangles;
    }
    return all;
  }

  void add_channel(std::size_t input, std::size_t output, const char* path,
                   const char* interpolation) {
    samplers_.push_back({{"input", input}, {"output", output}, {"interpolation", interpolation}});
    channels_.push_back({{"sampler", samplers_.size() - 1},
                         {"target", {{"node", nodes_.size() - 1}, {"path", path}}}});
  }

  void animate_weights(const ShownPart& part, const std::vector<int>& target_of,
                       std::size_t targets) {
    const auto from = times_.begin() + static_cast<std::ptrdiff_t>(part.first);
    const std::vector<float> times(from, from + static_cast<std::ptrdiff_t>(target_of.size()));
    std::vector<float> weights(target_of.size() * targets);
    for (std::size_t f = 0; f < target_of.size(); ++f)
      if (target_of[f] >= 0)
        weights[f * targets + static_cast<std::size_t>(target_of[f])] = 1;
    add_channel(arrays_.scalars(times, true), arrays_.scalars(weights, false), "weights", "LINEAR");
  }

  void animate_presence(const ShownPart& part) {
    std::vector<Float3> scales;
    for (std::size_t f = 0; f < times_.size(); ++f) {
      const float one = f >= part.first && f < part.first + part.points.size() ? 1 : 0;
      scales.push_back({one, one, one});
    }
    if (!all_times_)
      all_times_ = arrays_.scalars(times_, true);
    const std::size_t view = arrays_.view(scales.data(), scales.size() * sizeof(Float3), no_target);
    const std::size_t output = arrays_.accessor({{"bufferView", view},
                                                 {"componentType", float32},
                                                 {"count", scales.size()},
                                                 {"type", "VEC3"}});
    add_channel(*all_times_, output, "scale", "STEP");
  }

  const ShownScene& scene_;
  std::vector<float> times_;
  bool stored_, displaced_;
  std::vector<Float3> ramp_;
  Arrays arrays_;
  Json nodes_ = Json::array(), meshes_ = Json::array(), materials_ = Json::array();
  Json channels_ = Json::array(), samplers_ = Json::array();
  std::optional<std::size_t> all_times_;
};

std::string number_bytes(std::uint32_t value) {
  std::string bytes;
  for (int k = 0; k < 4; ++k)
    bytes += static_cast<char>(value >> (8 * k) & 0xff);
  return bytes;
}

} // namespace

std::vector<float> animation_times(const std::vector<double>& times) {
  std::vector<float> seconds;
  for (const double time : times)
    seconds.push_back(static_cast<float>(time));
  const auto not_later = [](float a, float b) { return !(b > a); };
  if (std::ranges::adjacent_find(seconds, not_later) == seconds.end())
    return seconds;
  for (std::size_t f = 0; f < seconds.size(); ++f)
    seconds[f] = static_cast<float>(static_cast<double>(f) / fps);
  return seconds;
}

std::uint64_t write_glb(Output& output, const ShownScene& scene) {
  auto [json, bytes] = GlbMaker(scene).made();
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::uint64_t size = 12 + 8 + text.size() + (bytes.empty() ? 0 : 8 + bytes.size());
  if (size > UINT32_MAX)
    throw Error(output.name(), "the glTF file would have " + std::to_string(size) +
                                   " bytes, expected fewer than 4 GiB: fewer frames by --frames");
  const auto number = [](std::uint64_t value) {
    return number_bytes(static_cast<std::uint32_t>(value));
  };
  output.write("glTF" + number(2) + number(size) + number(text.size()) + "JSON" + text);
  if (!bytes.empty()) {
    output.write(number(bytes.size()) + std::string("BIN\0", 4));
    output.write(bytes);
  }
  return size;
}

} // namespace gewebe::formats
