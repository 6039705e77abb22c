#pragma once
// Heads of NIfTI-1 images that are written: NIfTI-1 data format (DFWG, nifti.nimh.nih.gov, 2004).

#include "volume/grid.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace gewebe::formats {

inline constexpr std::size_t nifti_header_bytes = 352; // with the flag that no extension follows

class NiftiHeader {
public:
  template <class T>
  void put(std::size_t at, T value) {
    std::memcpy(bytes_.data() + at, &value, sizeof(T));
  }
  void put_real(std::size_t at, double value) { put(at, static_cast<float>(value)); }
  void put_text(std::size_t at, std::string_view text);
  std::string_view bytes() const { return {bytes_.data(), bytes_.size()}; }

private:
  std::array<char, nifti_header_bytes> bytes_{};
};

/// The head of an image of float32 in mm. The affine of the first three axes, RAS, is the sform,
/// and the qform where axes are at right angles. \param dim  number of axes, then their sizes
/// \param what  a description; up to 79 bytes of it are written
NiftiHeader nifti_header(const std::array<int, 8>& dim, std::int16_t intent,
                         const volume::GridTransform& transform, std::string_view what);

} // namespace gewebe::formats
