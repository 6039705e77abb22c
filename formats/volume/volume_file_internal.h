#pragma once
// The two ways to OpenVDB's streams; for formats/volume/volume_file.cpp and its tests.

#include "formats/volume/volume_file.h"

namespace gewebe::formats {

/// Layout of leaves in a stream.
enum class StreamWay {
  parallel, ///< we: leaves are packed and unpacked by all threads (format 224, of OpenVDB 10)
  plain     ///< OpenVDB's own reader and writer, whatever their format is
};

/// The way that the others take: parallel, unless OpenVDB writes a format that we don't know.
extern const StreamWay usual_way;

volume::Grid volume_from_bytes(std::string_view bytes, const std::string& name,
                               const Context& context, StreamWay way, Space* space = nullptr);
void write_volume(Output& output, const volume::Grid& grid, const Context& context, Packing packing,
                  StreamWay way, Space space = Space::unknown);

} // namespace gewebe::formats
