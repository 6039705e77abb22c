#pragma once
// The XDMF file beside a result as HDF5: what its frames hold, by the names of its arrays.

#include "formats/store/hdf5_internal.h"

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace gewebe::formats {

/// \param name the HDF5 file's name, without folder, to which the text refers
/// \throw Error if the file is no result, or what `write` throws
void write_xdmf(const hdf5::File& result, const std::string& name,
                const std::function<void(std::string_view)>& write);

/// Name of the view of a row of the dataset `set` (hdf5::Group::create_row_view), in the group
/// "frames" of its shape.
std::string frame_view_name(const std::string& set, std::uint64_t row);

/// Its path beside a result: PATH with the suffix .xdmf.
std::string xdmf_path(const std::string& path);

/// Bytes that the text has at most for one frame of one object or instrument.
std::uint64_t xdmf_bytes(const std::string& file, const std::string& object, bool fields);

} // namespace gewebe::formats
