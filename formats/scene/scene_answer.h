#pragma once
// What a scene answers to a step, as text: gewebe_serve(5).

#include "fem/stress.h"
#include "fem/stress_error.h"
#include "scene/simulation.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace gewebe::formats {

/// "cut NAME springs S doubled D nodes N", or what else cutting did.
std::string cutting_line(const scene::Simulation& simulation, const scene::Cutting& cutting);
/// Whether its triangles are others since the last answer.
bool topology_changed(const scene::Simulation& simulation, std::size_t object);

/// Answer of `emit stress` for an object.
struct StressAnswer {
  std::size_t object = 0;
  std::span<const std::uint32_t> nodes;           ///< ascending
  std::span<const linalg::SymmetricBlock> stress; ///< of all nodes of the object, Pa
};

/// Answer of --estimate for an object; none where errors can't be estimated.
struct EstimateAnswer {
  std::size_t object = 0;
  std::optional<fem::DiscretisationError> error{};
};

/// What answers have beside the state of the simulation.
struct AnswerFields {
  std::span<const StressAnswer> stresses{};
  std::span<const EstimateAnswer> estimates{};
};

/// The answer to a step, from "step K T" to "done": jumps of objects that changed their method,
/// what cutting did, forces, shapes and stresses as far as the scene emits them. \pre the models of
/// all objects are known where shapes are emitted
std::string text_answer(const scene::Simulation& simulation, std::uint64_t step,
                        const AnswerFields& fields = {});

/// "instruments n", then for each that is there a line: its name and what `tell` adds to it.
std::string
instrument_lines(const scene::Simulation& simulation,
                 const std::function<void(std::string&, const scene::InstrumentReport&)>& tell);
/// Adds a blank and the number, -0 as 0, for each; for x, y and z.
void append_numbers(std::string& line, std::initializer_list<double> values);
void append_numbers(std::string& line, const Vec3& v);

/// "ok LINE": it is done.
std::string text_ok(std::uint64_t line);

/// "sync T", the time of the scene, and "ready T", the greeting of a client.
std::string text_sync(const scene::Simulation& simulation);
std::string text_ready(const scene::Simulation& simulation);

/// "error LINE: TEXT", one line whatever the text holds.
std::string text_error(std::uint64_t line, std::string_view text);

} // namespace gewebe::formats
