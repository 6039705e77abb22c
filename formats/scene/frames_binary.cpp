#include "formats/scene/frames_binary.h"

#include "base/error.h"
#include "formats/scene/scene_answer.h"
#include "geometry/vector_at.h"

#include <cmath>
#include <cstddef>
#include <span>

namespace gewebe::formats {

namespace {

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append_head(std::string& bytes, const FrameHead& head) {
  append(bytes, frame_magic);
  append(bytes, static_cast<std::uint32_t>(head.kind));
  append(bytes, head.object);
  append(bytes, head.step);
  append(bytes, head.count);
}

void append_single(std::string& bytes, double value) {
  const auto single = static_cast<float>(value);
  if (!std::isfinite(single))
    throw Error("a position or force is too large for single precision, expected a smaller one");
  append(bytes, single);
}

void append_single(std::string& bytes, const Vec3& v) {
  for (int a = 0; a < 3; ++a)
    append_single(bytes, v[a]);
}

void append_cutting(std::string& bytes, const scene::Cutting& c, std::uint64_t step) {
  const auto frame = [&](gewebe::formats::FrameKind kind, std::size_t object, auto... values) {
    gewebe::formats::append_head(
        bytes, {kind, static_cast<std::uint32_t>(object), step, sizeof...(values)});
    (gewebe::formats::append(bytes, static_cast<std::uint32_t>(values)), ...);
  };
  switch (c.kind) {
  case scene::Cutting::Kind::cut:
    return frame(FrameKind::cut, c.object, c.springs, c.doubled, c.nodes);
  case scene::Cutting::Kind::part:
    return frame(FrameKind::part, c.part, c.object, c.nodes);
  case scene::Cutting::Kind::loose:
    return frame(FrameKind::loose, c.object, c.nodes);
  case scene::Cutting::Kind::restored:
    return frame(FrameKind::restored, c.object, c.nodes);
  }
}

std::string text_frame(FrameKind kind, std::uint64_t step, std::string_view text) {
  const std::size_t words = (text.size() + 3) / 4;
  std::string bytes;
  append_head(bytes, {kind, 0, step, words});
  bytes += text;
  bytes.resize(28 + 4 * words, '\0');
  return bytes;
}

} // namespace

std::string binary_answer(const scene::Simulation& simulation, std::uint64_t step,
                          const AnswerFields& fields) {
  std::string bytes;
  for (const scene::MethodJump& jump : simulation.news().jumps) {
    append_head(bytes, {FrameKind::jump, static_cast<std::uint32_t>(jump.object), step, 1});
    append_single(bytes, jump.size);
  }
  const auto objects = static_cast<std::uint32_t>(simulation.object_count());
  for (const scene::Cutting& c : simulation.news().cuttings)
    append_cutting(bytes, c, step);
  for (std::uint32_t i = 0; simulation.settings().emits.any_shapes() && i < objects; ++i) {
    if (!topology_changed(simulation, i))
      continue;
    const std::vector<Triangle>& triangles = simulation.model(i).triangles;
    append_head(bytes, {FrameKind::triangles, i, step, 3 * triangles.size()});
    for (const Triangle& t : triangles)
      append(bytes, t);
  }
  for (std::uint32_t i = 0; simulation.settings().emits.forces && i < objects; ++i) {
    const std::vector<contact::NodeVector>& forces = simulation.contact_forces(i);
    append_head(bytes, {FrameKind::nodes, i, step, forces.size()});
    for (const contact::NodeVector& f : forces)
      append(bytes, f.node);
    append_head(bytes, {FrameKind::forces, i, step, 3 * forces.size()});
    for (const contact::NodeVector& f : forces)
      append_single(bytes, f.value);
  }
  for (std::uint32_t i = 0; simulation.settings().emits.any_shapes() && i < objects; ++i) {
    const std::vector<model::Node>& nodes = simulation.model(i).nodes;
    const bool all = simulation.settings().emits.shapes;
    const std::size_t count = all ? nodes.size() : simulation.surface_nodes(i);
    const std::span<const double> u =
        all ? simulation.displacement(i) : simulation.surface_displacement(i);
    append_head(bytes, {FrameKind::shapes, i, step, 3 * count});
    bytes.reserve(bytes.size() + 12 * count);
    for (std::size_t k = 0; k < count; ++k)
      append_single(bytes, nodes[k].position + vector_at(u, k));
  }
  for (const StressAnswer& of : fields.stresses) {
    const auto object = static_cast<std::uint32_t>(of.object);
    append_head(bytes, {FrameKind::nodes, object, step, of.nodes.size()});
    for (const std::uint32_t node : of.nodes)
      append(bytes, node);
    append_head(bytes, {FrameKind::stress, object, step, 7 * of.nodes.size()});
    for (const std::uint32_t node : of.nodes) {
      for (const double value : of.stress[node])
        append_single(bytes, value);
      append_single(bytes, fem::von_mises(of.stress[node]));
    }
  }
  for (const EstimateAnswer& of : fields.estimates) {
    append_head(bytes, {FrameKind::estimate, static_cast<std::uint32_t>(of.object), step,
                        of.error ? 4U : 0U});
    if (of.error)
      for (const double value :
           {of.error->relative, of.error->force, of.error->displacement, of.error->stress})
        append_single(bytes, value);
  }
  for (std::uint32_t k = 0;
       simulation.settings().emits.instruments && k < simulation.instrument_count(); ++k) {
    const scene::InstrumentReport report = simulation.instrument(k);
    if (!report.present)
      continue;
    append_head(bytes, {FrameKind::instrument, k, step, report.hand ? 12U : 9U});
    for (const Vec3& v : {report.pose.place, report.force, report.torque})
      append_single(bytes, v);
    if (report.hand)
      append_single(bytes, *report.hand);
  }
  return bytes + binary_sync(simulation, step);
}

std::string binary_sync(const scene::Simulation& simulation, std::uint64_t step) {
  std::string bytes;
  append_head(bytes, {FrameKind::done, 0, step, 2});
  append(bytes, simulation.time());
  return bytes;
}

std::string binary_error(std::uint64_t step, std::string_view text) {
  return text_frame(FrameKind::error, step, text);
}

std::string binary_told(std::uint64_t step, std::string_view text) {
  return text_frame(FrameKind::told, step, text);
}

std::string binary_ok(std::uint64_t step, std::uint64_t line) {
  std::string bytes;
  append_head(bytes, {FrameKind::ok, 0, step, 2});
  append(bytes, line);
  return bytes;
}

} // namespace gewebe::formats
