#include "formats/volume/label_volume_internal.h"
// Based on: NIfTI-1 and NIfTI-2 data format (DFWG, nifti.nimh.nih.gov, 2004 and 2011).

#include "base/error.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace gewebe::formats {
namespace {

using namespace std::string_view_literals;

/// Places of the fields in the two versions of the header.
struct Fields {
  std::size_t magic, datatype, dim, pixdim, vox_offset, slope, intercept, units, qform_code,
      sform_code, quaternion, qoffset, srow, size;
};
constexpr Fields fields_1{344, 70, 40, 76, 108, 112, 116, 123, 252, 254, 256, 268, 280, 348};
constexpr Fields fields_2{4, 12, 16, 104, 168, 176, 184, 500, 344, 348, 352, 376, 400, 540};

std::int32_t native_int(std::string_view bytes, bool big_endian) {
  std::array<unsigned char, 4> b{};
  std::memcpy(b.data(), bytes.data(), 4);
  std::uint32_t value = 0;
  for (std::size_t n = 0; n < 4; ++n)
    value |= std::uint32_t{b.at(big_endian ? 3 - n : n)} << (8 * n);
  return static_cast<std::int32_t>(value);
}

class Header {
public:
  Header(std::string bytes, const std::string& name) : bytes_(std::move(bytes)), name_(name) {
    big_endian_ = native_int(bytes_, true) == 348 || native_int(bytes_, true) == 540;
    version_ = native_int(bytes_, big_endian_) == 348 ? 1 : 2;
    f_ = version_ == 1 ? fields_1 : fields_2;
  }

  int version() const { return version_; }
  const Fields& f() const { return f_; }
  bool big_endian() const { return big_endian_; }
  std::string place(std::size_t byte) const { return name_ + ": byte " + std::to_string(byte); }
  std::string_view text(std::size_t at, std::size_t count) const {
    return std::string_view(bytes_).substr(at, count);
  }

  // Fields whose width depends on the version.
  std::int64_t dim(std::size_t n) const {
    return version_ == 1 ? get<std::int16_t>(f_.dim + 2 * n) : get<std::int64_t>(f_.dim + 8 * n);
  }
  double real(std::size_t field, std::size_t n = 0) const {
    return version_ == 1 ? static_cast<double>(get<float>(field + 4 * n))
                         : get<double>(field + 8 * n);
  }
  std::int32_t code(std::size_t field) const {
    return version_ == 1 ? get<std::int16_t>(field) : get<std::int32_t>(field);
  }
  std::int32_t datatype() const { return get<std::int16_t>(f_.datatype); }
  std::int32_t units() const {
    return version_ == 1 ? get<std::uint8_t>(f_.units) : get<std::int32_t>(f_.units);
  }
  std::uint64_t vox_offset(std::uint64_t min) const {
    if (version_ == 1) {
      const double offset = real(f_.vox_offset);
      if (offset == 0)
        return min; // as nibabel reads it
      if (!(offset >= static_cast<double>(min) && offset <= 1e9) || offset != std::trunc(offset))
        fail_offset(min);
      return static_cast<std::uint64_t>(offset);
    }
    const auto offset = get<std::int64_t>(f_.vox_offset);
    if (offset == 0)
      return min;
    if (offset < static_cast<std::int64_t>(min) || offset > 1000000000)
      fail_offset(min);
    return static_cast<std::uint64_t>(offset);
  }

private:
  template <class T>
  T get(std::size_t at) const {
    std::array<char, sizeof(T)> raw{};
    std::memcpy(raw.data(), bytes_.data() + at, sizeof(T));
    if (big_endian_ != (std::endian::native == std::endian::big))
      std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }
  [[noreturn]] void fail_offset(std::uint64_t min) const {
    throw Error(place(f_.vox_offset), "vox_offset is wrong, expected a whole number from " +
                                          std::to_string(min) + " to 1e9");
  }

  std::string bytes_;
  const std::string& name_;
  bool big_endian_ = false;
  int version_ = 1;
  Fields f_{};
};

ScalarType scalar_type(const Header& header) {
  switch (header.datatype()) {
  case 2:
    return ScalarType::u8;
  case 4:
    return ScalarType::i16;
  case 8:
    return ScalarType::i32;
  case 16:
    return ScalarType::f32;
  case 64:
    return ScalarType::f64;
  case 256:
    return ScalarType::i8;
  case 512:
    return ScalarType::u16;
  case 768:
    return ScalarType::u32;
  case 1024:
    return ScalarType::i64;
  case 1280:
    return ScalarType::u64;
  default:
    throw Error(header.place(header.f().datatype),
                "datatype " + std::to_string(header.datatype()) +
                    ", expected whole numbers or floats of one component");
  }
}

Int3 volume_size(const Header& header) {
  const std::string place = header.place(header.f().dim);
  const std::int64_t dimensions = header.dim(0);
  if (dimensions < 3 || dimensions > 7)
    throw Error(place, std::to_string(dimensions) + " dimensions, expected 3");
  for (std::size_t n = 4; n <= static_cast<std::size_t>(dimensions); ++n)
    if (header.dim(n) != 1)
      throw Error(place, std::to_string(header.dim(n)) + " volumes along dimension " +
                             std::to_string(n) + ", expected one");
  return checked_size(place, {header.dim(1), header.dim(2), header.dim(3)});
}

double unit_of(const Header& header) {
  switch (header.units() & 7) {
  case 0: // unknown: mm everywhere
  case 2:
    return 1;
  case 1:
    return 1000;
  case 3:
    return 0.001;
  default:
    throw Error(header.place(header.f().units), "xyzt_units " + std::to_string(header.units() & 7) +
                                                    ", expected metres, millimetres or microns");
  }
}

/// Rotation of a unit quaternion with given b, c, d (nifti1.h, method 2).
std::array<double, 9> rotation(const Header& header) {
  const Fields& f = header.f();
  const double b = header.real(f.quaternion, 0), c = header.real(f.quaternion, 1),
               d = header.real(f.quaternion, 2);
  const double rest = 1 - (b * b + c * c + d * d);
  // What rounding of the three numbers may leave.
  const double tolerance = 3 * (header.version() == 1 ? 0x1p-23 : 0x1p-52);
  if (!(rest >= -tolerance))
    throw Error(header.place(f.quaternion), "the quaternion is longer than 1, expected a rotation");
  const double a = rest <= tolerance ? 0 : std::sqrt(rest);
  // nibabel divides by the quaternion's square, which matters where a was set to 0.
  const double scale = 2 / (a * a + b * b + c * c + d * d);
  return {1 - scale * (c * c + d * d), scale * (b * c - a * d),     scale * (b * d + a * c),
          scale * (b * c + a * d),     1 - scale * (b * b + d * d), scale * (c * d - a * b),
          scale * (b * d - a * c),     scale * (c * d + a * b),     1 - scale * (b * b + c * c)};
}

volume::GridTransform affine(const Header& header, const Int3& size, bool& oriented) {
  const Fields& f = header.f();
  volume::GridTransform t;
  oriented = true;
  if (header.code(f.sform_code) > 0) {
    for (std::size_t n = 0; n < 12; ++n)
      t.m[n] = header.real(f.srow, n);
  } else {
    std::array<double, 3> spacing{};
    for (std::size_t a = 0; a < 3; ++a)
      spacing[a] = std::fabs(header.real(f.pixdim, a + 1));
    if (header.code(f.qform_code) > 0) {
      const std::array<double, 9> r = rotation(header);
      if (header.real(f.pixdim, 0) < 0)
        spacing[2] = -spacing[2];
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t a = 0; a < 3; ++a)
          t.m[4 * row + a] = r[3 * row + a] * spacing[a];
        t.m[4 * row + 3] = header.real(f.qoffset, row);
      }
    } else {
      oriented = false;
      spacing[0] = -spacing[0];
      for (std::size_t a = 0; a < 3; ++a) {
        t.m[5 * a] = spacing[a];
        t.m[4 * a + 3] = -spacing[a] * (size[a] - 1) / 2.0;
      }
    }
  }
  const double unit = unit_of(header);
  for (double& number : t.m)
    number *= unit;
  check_affine(header.place(header.code(f.sform_code) > 0   ? f.srow
                            : header.code(f.qform_code) > 0 ? f.quaternion
                                                            : f.pixdim),
               t);
  return t;
}

/// The image beside a header: .hdr -> .img, .hdr.gz -> .img.gz.
std::string image_of(const std::string& header) {
  for (const auto& [from, to] :
       {std::pair(".hdr.gz"sv, ".img.gz"sv), std::pair(".hdr"sv, ".img"sv)})
    if (header.ends_with(from))
      return header.substr(0, header.size() - from.size()) + std::string(to);
  throw Error(header, "is the header of a NIfTI pair, expected the suffix .hdr");
}

} // namespace

bool is_nifti(std::string_view bytes) {
  if (bytes.size() < 4)
    return false;
  for (const bool big_endian : {false, true}) {
    if (native_int(bytes, big_endian) == 348)
      return bytes.size() < 348 || bytes.substr(344, 4) == "n+1\0"sv ||
             bytes.substr(344, 4) == "ni1\0"sv;
    if (native_int(bytes, big_endian) == 540)
      return bytes.size() < 12 || bytes.substr(4, 8) == "n+2\0\r\n\032\n"sv ||
             bytes.substr(4, 8) == "ni2\0\r\n\032\n"sv;
  }
  return false;
}

LabelVolume read_nifti(BufferedBytes& bytes, const LabelRequest& request) {
  const std::string& name = bytes.name();
  std::string raw(540, '\0');
  const std::string_view first = bytes.peek(4);
  const bool one = native_int(first, false) == 348 || native_int(first, true) == 348;
  raw.resize(one ? 348 : 540);
  if (const std::size_t got = bytes.read(raw.data(), raw.size()); got < raw.size())
    throw Error(name, "ends after " + std::to_string(got) + " bytes, expected a NIfTI header of " +
                          std::to_string(raw.size()));
  const Header header(std::move(raw), name);
  const Fields& f = header.f();
  VoxelLayout layout;
  layout.size = volume_size(header);
  layout.type = scalar_type(header);
  layout.big_endian = header.big_endian();
  const double slope = header.real(f.slope), intercept = header.real(f.intercept);
  if (slope != 0 && std::isfinite(slope)) {
    if (!std::isfinite(intercept))
      throw Error(header.place(f.intercept), "scl_inter is not finite, expected a number");
    layout.slope = slope;
    layout.intercept = intercept;
  }
  bool oriented = true;
  layout.transform = affine(header, layout.size, oriented);

  LabelVolume volume;
  if (header.text(f.magic, 2) == "ni") {
    char more = 0;
    if (!request.side_files)
      throw Error(name, "is the header of a NIfTI pair, expected a file name or one file of both");
    (void)bytes.read(&more, 1); // extensions may follow; reads the checksum of a compressed one
    const std::string image = image_of(name);
    require_no_pipe(image);
    Input input(image);
    (void)input.peek(1);
    StreamBytes source(input.stream(), image);
    BufferedBytes packed(source, image);
    std::optional<InflatedBytes> inflated;
    ByteSource* data = &packed;
    if (is_gzip(packed.peek(2)) && image.ends_with(".gz"))
      data = &inflated.emplace(packed, image);
    BufferedBytes voxels(*data, image);
    voxels.skip(header.vox_offset(0));
    volume = read_voxels(voxels, image, layout, request);
  } else {
    const std::uint64_t min = header.version() == 1 ? 352 : 544;
    bytes.skip(header.vox_offset(min) - (min - 4));
    volume = read_voxels(bytes, name, layout, request);
  }
  volume.format = header.version() == 1 ? "NIfTI-1" : "NIfTI-2";
  if (!oriented)
    volume.warnings.push_back(name + ": neither qform nor sform: the place in the world is "
                                     "guessed, centred and with x from right to left");
  return volume;
}

} // namespace gewebe::formats
