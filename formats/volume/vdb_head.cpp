// Layout as written by OpenVDB since file version 222: magic, version, library version, offsets
// flag, UUID, file metadata, grid count, then per grid: descriptor, compression, metadata,
// transform, tree.

#include "base/error.h"
#include "formats/volume/volume_file.h"

#include <cstdint>
#include <cstring>

namespace gewebe::formats {
namespace {

class Reader {
public:
  Reader(std::string_view bytes, const std::string& name, std::size_t position = 0)
      : bytes_(bytes), name_(name), position_(position) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name_, "byte " + std::to_string(position_) + ": " + what);
  }
  std::string_view take(std::uint64_t count, const char* what) {
    if (count > bytes_.size() - position_)
      fail(std::string("ends early, expected ") + what + " of " + std::to_string(count) + " bytes");
    const std::string_view part = bytes_.substr(position_, count);
    position_ += count;
    return part;
  }
  template <class T>
  T number(const char* what) {
    T value{};
    std::memcpy(&value, take(sizeof value, what).data(), sizeof value);
    return value;
  }
  std::string_view string(const char* what) { return take(number<std::uint32_t>(what), what); }
  void metadata() {
    const auto count = number<std::uint32_t>("a metadata count");
    for (std::uint32_t i = 0; i < count; ++i) {
      (void)string("a metadata name");
      (void)string("a metadata type");
      (void)string("a metadata value");
    }
  }

private:
  std::string_view bytes_;
  const std::string& name_;
  std::size_t position_;
};

/// Descriptor, compression, metadata and the kind of transform of a grid.
void check_grid(Reader& reader) {
  (void)reader.string("a grid name");
  (void)reader.string("a grid type");
  (void)reader.string("an instance name");
  (void)reader.take(24, "grid offsets");
  (void)reader.take(4, "a compression flag");
  reader.metadata();
  if (reader.string("a kind of transform") == "NonlinearFrustumMap") // holds another such string
    reader.fail("the grid has a frustum transform, expected an affine one");
}

} // namespace

void check_vdb_head(std::string_view bytes, const std::string& name) {
  Reader reader(bytes, name);
  if (reader.number<std::int64_t>("the VDB magic") != 0x56444220)
    throw Error(name, "byte 0: no OpenVDB stream, expected the magic bytes of one");
  const auto version = reader.number<std::uint32_t>("a version");
  if (version < 222 || version > 224)
    throw Error(name, "byte 8: OpenVDB file version " + std::to_string(version) +
                          ", expected 222 to 224");
  (void)reader.take(8, "a library version");
  (void)reader.take(1, "a flag");
  (void)reader.take(36, "a UUID");
  reader.metadata();
  const auto grids = reader.number<std::int32_t>("a grid count");
  if (grids < 1)
    reader.fail("no grid, expected a float grid");
  check_grid(reader);
}

void check_vdb_grid(std::string_view bytes, std::size_t position, const std::string& name) {
  Reader reader(bytes, name, position);
  check_grid(reader);
}

} // namespace gewebe::formats
