#pragma once
// What a run leaves: gewebe_results(5). HDF5 with an XDMF beside it, the last shape or every
// shape as a mesh, or curves and forces as CSV.

#include "contact/instrument.h"
#include "contact/load.h"
#include "fem/stress.h"
#include "fem/stress_error.h"
#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

/// An object in one frame.
struct FrameObject {
  std::span<const double> displacement;        ///< 3 n numbers
  std::span<const contact::NodeVector> forces; ///< at displaced nodes
  /// Stresses of a solid, if requested: from one frame on in all.
  const fem::SolidFields* fields = nullptr;
  /// Errors of its mesh, if requested; an empty one: they can't be estimated.
  const std::optional<fem::DiscretisationError>* estimate = nullptr;
  /// mm, of a node, if a curve is to have it.
  std::optional<double> largest_displacement{};
};

/// The springs that attach one object to another, in one frame.
struct FrameAttachment {
  std::string_view name, other;
  std::uint64_t springs = 0;
  Vec3 force; ///< of all springs on the first object, 1e-6 N
};

/// An instrument in one frame.
struct FrameInstrument {
  std::string_view name; ///< as those of objects; no two have the same
  bool present = false;  ///< else what follows does not count
  contact::InstrumentShape shape;
  contact::Pose pose;
  Vec3 hand;               ///< that leads it: its own place where it is not coupled
  Vec3 force, torque;      ///< of all objects on it, 1e-6 N, and 1e-9 N m about its place
  std::uint64_t nodes = 0; ///< that it touches or grasps
};

/// What a run that failed has left of its result.
struct KeptResult {
  std::string what;        ///< "26 frames", "the shape"
  double time = 0;         ///< s, of the last frame
  bool all_frames = false; ///< or that of the last one alone
  std::string left_out;    ///< why a file beside it could not be written; empty: it is there
  std::string file;        ///< its name
};

/// "1 frame", "26 frames".
std::string frames_text(std::uint64_t frames);

class ResultWriter {
public:
  ResultWriter() = default;
  ResultWriter(const ResultWriter&) = delete;
  ResultWriter& operator=(const ResultWriter&) = delete;
  virtual ~ResultWriter() = default;

  /// Whether it writes shapes; else models may be empty, and displacements too.
  virtual bool wants_models() const { return true; }
  /// Whether it writes numbers over time: largest displacements and attachments.
  virtual bool wants_curves() const { return false; }
  /// An object that is in all frames to come; in those before it was at rest. Names differ and need
  /// no quoting.
  virtual void add_object(const std::string& name, const model::Model& model) = 0;
  /// One that came off another, which is in no frame before.
  virtual void add_part(const std::string& name, const model::Model& model) {
    add_object(name, model);
  }
  /// The model of an object, in the order in which they were added, is another from the next frame
  /// on, as after a cut. Ignored by writers without shapes. \param origin by node: the node of its
  /// first model that it is, or is a copy of; empty: all as they came
  virtual void change_object(std::size_t /*object*/, const model::Model& /*model*/,
                             std::span<const std::uint32_t> /*origin*/) {}
  /// All instruments, in an order that stays, as they are in the next frame alone. Ignored by
  /// writers without instruments.
  virtual void set_instruments(std::span<const FrameInstrument> /*instruments*/) {}
  /// All attachments in the next frame alone. Ignored by writers without curves.
  virtual void set_attachments(std::span<const FrameAttachment> /*attachments*/) {}
  /// \pre as many objects as were added, in their order
  virtual void add_frame(double time, std::span<const FrameObject> objects) = 0;
  /// Nothing appears without it, except the files of a series. \throw Error
  virtual void commit() = 0;
  /// From now on a signal or a crash leaves what is on the disk, see partial_result.h.
  virtual void outlive_signals() {}
  /// In place of `commit`, where the run or `commit` failed: the frames that were added stay, in a
  /// file whose name says that it isn't all (partial_name). Nothing but the frame at rest, or no
  /// file: nothing is kept. The file states why
  /// \throw Error if they can't be kept
  virtual std::optional<KeptResult> keep_partial(const std::string& /*why*/) {
    return std::nullopt;
  }
};

/// The kinds that there are: h5, ply, obj, vtu, vtkhdf, csv.
const std::vector<Kind>& result_kinds();

/// What the rows of a CSV are: frames with all their numbers, or displaced and touched nodes.
enum class TableRows { frame, node };

/// A ply, obj or vtu whose path holds a pattern, %d or %04d, is a series: one file for each frame.
/// \throw Error, UsageError as Output; h5 and vtkhdf need a file, and h5 writes PATH with
/// suffix .xdmf beside it
std::unique_ptr<ResultWriter> open_result(Kind kind, const std::string& path,
                                          const Output::Options& options,
                                          TableRows rows = TableRows::frame);

} // namespace gewebe::formats
