#pragma once
// Volumes as OpenVDB streams (gewebe_volume(5)): one float grid, on a pipe as in a file. The same
// content gives the same bytes: the UUID of the stream is derived from the content.

#include "formats/stream/stream.h"
#include "geometry/space.h"
#include "volume/grid.h"

#include <string>
#include <string_view>

namespace gewebe::formats {

/// Reads the grid `density`, or the only float grid if none has that name.
/// \throw Error with the place for anything that is not a whole, finite, affine float grid
/// `space` gets what the metadata gewebe_space states.
volume::Grid read_volume(Input& input, const Context& context, Space* space = nullptr);

/// The same for bytes that are there already.
volume::Grid volume_from_bytes(std::string_view bytes, const std::string& name,
                               const Context& context = {}, Space* space = nullptr);

/// How the values of leaves stand in a stream: those of active voxels, which cost a read and a
/// write of memory alone, or these packed by blosc, to half to nine tenths of the bytes and at
/// several times the cost.
enum class Packing { blosc, none };

/// Writes one grid.
void write_volume(Output& output, const volume::Grid& grid, const Context& context,
                  Packing packing = Packing::blosc, Space space = Space::unknown);

/// What the head of an OpenVDB stream says, checked without OpenVDB: it believes every size it
/// reads. Walks magic, version, file metadata and the first grid's descriptor, metadata and kind of
/// transform. \throw Error (place = name, "byte N: …") if that much is not there or not sane
void check_vdb_head(std::string_view bytes, const std::string& name);

/// The same for a grid whose descriptor begins at `position`.
void check_vdb_grid(std::string_view bytes, std::size_t position, const std::string& name);

} // namespace gewebe::formats
