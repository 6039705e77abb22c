#pragma once
// What a scene answers to a step, as binary frames: gewebe_serve(5). All numbers are little-endian.

#include "formats/scene/scene_answer.h"
#include "scene/simulation.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace gewebe::formats {

inline constexpr std::uint32_t frame_magic = 0x46425747; ///< "GWBF" in the stream

/// What the payload of a frame is.
enum class FrameKind : std::uint32_t {
  shapes = 0,     ///< 3 float32 of each node: where it stands
  forces = 1,     ///< 3 float32 of each displaced node, those of the frame before
  nodes = 2,      ///< uint32: the numbers of the displaced nodes
  done = 3,       ///< one float64, the time: the answer is whole
  error = 4,      ///< text, filled up with zero bytes: a line was refused
  jump = 5,       ///< one float32, mm: the object became elastostatic
  instrument = 6, ///< 9 float32: place, force, torque; object is its place among the instruments
  cut = 7,        ///< 3 uint32: springs gone, nodes doubled, nodes now
  part = 8,       ///< 2 uint32: the object that it came off, its nodes; object is the new one
  loose = 9,      ///< 1 uint32, its nodes: the object goes on elastodynamic, for K is singular
  restored = 10,  ///< 1 uint32, its nodes: the model is as it came
  triangles = 11, ///< 3 uint32 of each triangle, where they have changed
  stress =
      12,    ///< 7 float32 of each node: the tensor, von Mises's stress; those of the frame before
  ok = 13,   ///< one uint64: the line of this number is done
  told = 14, ///< text, padded with zero bytes: answer to a question
  estimate = 15, ///< 4 float32: relative error, of force, displacement and stress; or nothing
};

/// The head of each frame, without gaps: 28 bytes.
struct FrameHead {
  FrameKind kind{};
  std::uint32_t object = 0; ///< its place in the scene, from 0
  std::uint64_t step = 0;   ///< from 1
  std::uint64_t count = 0;  ///< of values of 4 bytes that follow
};

/// The frames that answer a step: jump, then what cutting did, triangles, then nodes and forces,
/// then shapes of all objects, then nodes and stresses, then estimates, then instruments, as far as
/// the scene emits them, then done. \pre as text_answer \throw Error where a number does not fit
/// single precision
std::string binary_answer(const scene::Simulation& simulation, std::uint64_t step,
                          const AnswerFields& fields = {});

/// The frame that answers sync: done alone.
std::string binary_sync(const scene::Simulation& simulation, std::uint64_t step);

/// The frame that refuses a line, behind `step` answered steps; its text is text_error's.
std::string binary_error(std::uint64_t step, std::string_view text);

/// The frame that acknowledges a line, and the frame of text_query's answer; after so many steps.
std::string binary_ok(std::uint64_t step, std::uint64_t line);
std::string binary_told(std::uint64_t step, std::string_view text);

} // namespace gewebe::formats
