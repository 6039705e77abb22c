#pragma once
// What a run leaves: gewebe_results(5). HDF5 with an XDMF beside it, the last shape or every
// shape as a mesh, or the contact forces as CSV.

#include "contact/instrument.h"
#include "contact/load.h"
#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "model/model.h"
#include "solid/stress.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe {

/// An object in one frame.
struct FrameObject {
  std::span<const double> displacement; ///< 3 n numbers
  std::span<const NodeVector> forces;   ///< at displaced nodes
  /// Of a solid, where they are asked for: from one frame on in all.
  const SolidFields* fields = nullptr;
};

/// An instrument in one frame.
struct FrameInstrument {
  std::string_view name; ///< as those of objects; no two have the same
  bool present = false;  ///< else what follows does not count
  InstrumentShape shape;
  Pose pose;
  Vec3 hand;               ///< that leads it: its own place where it is not coupled
  Vec3 force, torque;      ///< of all objects on it, 1e-6 N, and 1e-9 N m about its place
  std::uint64_t nodes = 0; ///< that it touches or grasps
};

class ResultWriter {
public:
  ResultWriter() = default;
  ResultWriter(const ResultWriter&) = delete;
  ResultWriter& operator=(const ResultWriter&) = delete;
  virtual ~ResultWriter() = default;

  /// Whether it writes shapes; else models may be empty, and displacements too.
  virtual bool wants_models() const { return true; }
  /// An object that is in all frames to come; in those before it was at rest. Names differ and need
  /// no quoting.
  virtual void add_object(const std::string& name, const Model& model) = 0;
  /// One that came off another, which is in no frame before.
  virtual void add_part(const std::string& name, const Model& model) { add_object(name, model); }
  /// The model of an object, in the order in which they were added, is another from the next frame
  /// on, as after a cut. Nothing to who writes no shapes. \param origin by node: the node of its
  /// first model that it is, or is a copy of; empty: all as they came
  virtual void change_object(std::size_t /*object*/, const Model& /*model*/,
                             std::span<const std::uint32_t> /*origin*/) {}
  /// All instruments, in an order that stays, as they are in the next frame alone. Nothing to who
  /// writes none.
  virtual void set_instruments(std::span<const FrameInstrument> /*instruments*/) {}
  /// \pre as many objects as were added, in their order
  virtual void add_frame(double time, std::span<const FrameObject> objects) = 0;
  /// Nothing appears without it, but for the files of a series. \throw Error
  virtual void commit() = 0;
};

/// The kinds that there are: h5, ply, obj, vtu, vtkhdf, csv.
const std::vector<Kind>& result_kinds();

/// A ply, obj or vtu whose path holds a pattern, %d or %04d, is a series: one file for each frame.
/// \throw Error, UsageError as Output; h5 and vtkhdf need a file, and h5 writes PATH with
/// suffix .xdmf beside it
std::unique_ptr<ResultWriter> open_result(Kind kind, const std::string& path,
                                          const Output::Options& options);

} // namespace gewebe
