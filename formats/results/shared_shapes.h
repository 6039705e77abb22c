#pragma once
// Shapes of all objects in a file that other processes map: ffe-run --shapes-in, gewebe_serve(5).
//
// The file is a SharedHead, behind it frames, each in a place of its own that the head names. Frame
// S, counted from 1, is in buffer S mod 2, so that the last one stays whole while the next is
// written. `begun` is S before anything of frame S is written, `sequence` is S when all of it is.
// A reader
//   1. loads `sequence` (acquire), S; 0: there is no frame yet;
//   2. loads the place of buffer S mod 2; maps the file again where that lies behind what it
//   mapped;
//   3. copies what it needs of the frame;
//   4. loads `begun` (behind the copy). Below S + 2 the copy is whole; else begins again.
// `sequence` in place of `begun` would not do: it is S + 1 while frame S + 2 overwrites S.
//
// Numbers are little-endian and stand at multiples of their size, so that each is one load. The
// file never gets shorter while it is mapped; a buffer that is too small for its frame moves to its
// end.

#include "formats/stream/descriptor.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gewebe::formats {

inline constexpr std::uint64_t shared_magic = 0x4550414853425747; ///< "GWBSHAPE" in the file
inline constexpr std::uint64_t shared_version = 1;

struct SharedPlace {
  std::uint64_t offset = 0, bytes = 0; ///< in the file; a multiple of 64
};
struct SharedHead {
  std::uint64_t magic = shared_magic, version = shared_version;
  std::uint64_t begun = 0, sequence = 0;
  SharedPlace even, odd; ///< where frames of even and of odd numbers are
};
static_assert(sizeof(SharedHead) == 64);

/// Starts a frame. Behind it a SharedObject for each object in the order of the scene, then their
/// names, then positions of their nodes, float64 x, y, z in mm. All offsets count from here.
struct SharedFrame {
  std::uint64_t sequence = 0;
  std::uint64_t step = 0; ///< of the answer with the same shapes
  double time = 0;        ///< s
  /// Another one where objects, their numbers of nodes or their triangles are others than in the
  /// frame before.
  std::uint64_t generation = 0;
  std::uint64_t objects = 0;
  std::uint64_t bytes = 0; ///< of the frame
  std::array<std::uint64_t, 2> reserved{};
};
static_assert(sizeof(SharedFrame) == 64);

struct SharedObject {
  std::uint64_t name = 0, name_bytes = 0; ///< offset of its bytes
  std::uint64_t positions = 0, nodes = 0; ///< offset, a multiple of 64
};
static_assert(sizeof(SharedObject) == 32);

/// An object's shape.
struct SharedShape {
  std::string_view name;
  std::span<const double> positions; ///< 3 n numbers, mm
};

/// Makes the file and writes frames into it.
class SharedShapes {
public:
  /// Of its owner alone; it is gone at the end, as formats/stream/removal.h has it. In place of one
  /// that a killed run has left. \throw Error (place = path) if a run writes one there, something
  /// else is there, or it can't be made
  explicit SharedShapes(const std::string& path);
  ~SharedShapes();
  SharedShapes(const SharedShapes&) = delete;
  SharedShapes& operator=(const SharedShapes&) = delete;

  /// The next frame. \param changed whether triangles changed since the last one
  /// \throw Error (place = path) if the file can't grow; the last frame stays then
  void write(std::uint64_t step, double time, std::span<const SharedShape> objects, bool changed);

private:
  void make();
  void grow(std::size_t bytes);
  std::size_t room(std::uint64_t sequence, std::size_t bytes);
  void note_layout(std::span<const SharedShape> objects, bool changed);
  void put(std::size_t offset, std::uint64_t value) noexcept;
  void put_name(std::size_t offset, std::string_view name) noexcept;

  std::string path_;
  Descriptor file_;
  std::uint64_t device_ = 0, inode_ = 0; ///< of the path
  int removal_ = -1;
  unsigned char* memory_ = nullptr; ///< the file, mapped
  std::size_t bytes_ = 0;           ///< of it
  SharedHead head_;                 ///< as the file has it
  std::uint64_t generation_ = 0;
  std::vector<std::pair<std::string, std::size_t>> layout_; ///< names, numbers of coordinates
};

} // namespace gewebe::formats
