#pragma once
// The group of instruments in results as HDF5, as it grows.

#include "contact/instrument.h"
#include "formats/results/results_writer.h"
#include "formats/store/hdf5_internal.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gewebe::formats {

class InstrumentSets {
public:
  /// Those of the frame of this number, the next one; a file without any gets no group.
  /// \throw Error
  void add_frame(hdf5::Group& root, std::uint64_t frame,
                 std::span<const FrameInstrument> instruments);

private:
  /// Triangles at their places in some frames, one after the other.
  struct Surface {
    contact::InstrumentShape shape;
    std::uint64_t first = 0, end = 0; ///< frames
    std::uint64_t points = 0;
    hdf5::Dataset places;
    std::vector<Vec3> own; ///< in the instrument's coordinates
  };
  struct Series {
    std::string name;
    std::uint64_t first = 0; ///< frame
    hdf5::Group group, surface_group;
    hdf5::Dataset kind, radius, friction, ends, pose, hand, force, torque, touched;
    std::vector<Surface> surfaces;
  };
  Series begin(const std::string& name, std::uint64_t frame);
  static void append(Series& to, const FrameInstrument& of);
  static void show(Series& to, const FrameInstrument& of, std::uint64_t frame);

  std::optional<hdf5::Group> group_;
  std::vector<Series> series_; ///< by instrument
};

} // namespace gewebe::formats
