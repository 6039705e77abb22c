#include "formats/volume_file.h"

#include "base/digest.h"
#include "base/error.h"
#include "volume/grid_internal.h"

#include <openvdb/io/Stream.h>
#include <openvdb/util/logging.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <istream>
#include <mutex>
#include <ostream>
#include <streambuf>

namespace gewebe {
namespace {

constexpr std::size_t uuid_begin = 21;
constexpr std::size_t uuid_length = 36;
constexpr const char* isovalue_key = "gewebe_iso";
constexpr const char* band_key = "gewebe_band_iso";

void initialize_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] {
    openvdb::logging::setLevel(openvdb::logging::Level::Fatal);
    openvdb::initialize();
  });
}

/// Bytes in memory as a stream that throws where it ends: OpenVDB takes what a short read left in
/// its buffers for data.
class MemoryBuffer final : public std::streambuf {
public:
  MemoryBuffer(std::string& bytes, const std::string& name) : name_(name) {
    setg(bytes.data(), bytes.data(), bytes.data() + bytes.size());
  }

private:
  [[noreturn]] void fail() const {
    throw Error(name_, "byte " + std::to_string(egptr() - eback()) + ": ends early");
  }
  int_type underflow() override { fail(); }
  std::streamsize xsgetn(char* target, std::streamsize count) override {
    if (count > egptr() - gptr())
      fail();
    std::memcpy(target, gptr(), static_cast<std::size_t>(count));
    setg(eback(), gptr() + count, egptr());
    return count;
  }
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const off_type base = from == std::ios_base::beg   ? 0
                          : from == std::ios_base::cur ? gptr() - eback()
                                                       : egptr() - eback();
    const off_type target = base + offset;
    if (target < 0 || target > egptr() - eback())
      fail();
    setg(eback(), eback() + target, egptr());
    return {target};
  }
  pos_type seekpos(pos_type position, std::ios_base::openmode which) override {
    return seekoff(off_type(position), std::ios_base::beg, which);
  }

  const std::string& name_;
};

/// Passes bytes on, with the random UUID replaced by one made of the content's digest.
class UuidBuffer final : public std::streambuf {
public:
  UuidBuffer(std::streambuf& next, std::string uuid) : next_(next), uuid_(std::move(uuid)) {}

private:
  int_type overflow(int_type c) override {
    if (traits_type::eq_int_type(c, traits_type::eof()))
      return traits_type::not_eof(c);
    const char byte = traits_type::to_char_type(c);
    return xsputn(&byte, 1) == 1 ? c : traits_type::eof();
  }
  std::streamsize xsputn(const char* data, std::streamsize count) override {
    std::streamsize done = 0;
    for (; done < count && position_ < uuid_begin + uuid_length; ++done, ++position_) {
      const char byte = position_ < uuid_begin ? data[done] : uuid_[position_ - uuid_begin];
      next_.sputc(byte);
    }
    next_.sputn(data + done, count - done);
    position_ += static_cast<std::size_t>(count - done);
    return count;
  }
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    if (offset == 0 && from == std::ios_base::cur)
      return {static_cast<off_type>(position_)};
    return {off_type(-1)};
  }

  std::streambuf& next_;
  std::string uuid_;
  std::size_t position_ = 0;
};

/// UUID of version 8 (RFC 9562: contents of the maker's choice).
std::string uuid_of(std::uint64_t digest) {
  Digest second;
  second.add(digest);
  const std::string hex = digest_text(digest) + second.hex();
  std::string uuid = hex.substr(0, 8) + "-" + hex.substr(8, 4) + "-8" + hex.substr(13, 3) + "-8" +
                     hex.substr(17, 3) + "-" + hex.substr(20, 12);
  return uuid;
}

GridTransform transform_of(const openvdb::math::Transform& transform, const std::string& name) {
  if (!transform.isLinear())
    throw Error(name, "the grid has a frustum transform, expected an affine one");
  const openvdb::Mat4R matrix = transform.baseMap()->getAffineMap()->getMat4();
  GridTransform result; // OpenVDB multiplies row vectors from the left
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      result.m[static_cast<std::size_t>(row * 4 + column)] = matrix(column, row);
  for (const double value : result.m)
    if (!std::isfinite(value))
      throw Error(name, "the grid's transform is not finite");
  const Vec3 size = result.voxel_size();
  if (!(std::fabs(result.determinant()) > 1e-12 * size.x * size.y * size.z))
    throw Error(name, "the grid's transform is singular");
  return result;
}

openvdb::math::Transform::Ptr native_transform(const GridTransform& transform) {
  const auto& m = transform.m;
  if (transform == uniform_transform(m[0]))
    return openvdb::math::Transform::createLinearTransform(m[0]);
  return openvdb::math::Transform::createLinearTransform(
      openvdb::Mat4R(m[0], m[4], m[8], 0.0, m[1], m[5], m[9], 0.0, m[2], m[6], m[10], 0.0, m[3],
                     m[7], m[11], 1.0));
}

std::optional<double> number_metadata(const openvdb::GridBase& grid, const char* key,
                                      const std::string& name) {
  const openvdb::Metadata::ConstPtr metadata = grid[key];
  if (!metadata)
    return std::nullopt;
  double value = NAN;
  if (const auto* real = dynamic_cast<const openvdb::TypedMetadata<double>*>(metadata.get()))
    value = real->value();
  else if (const auto* single = dynamic_cast<const openvdb::TypedMetadata<float>*>(metadata.get()))
    value = static_cast<double>(single->value());
  if (!std::isfinite(value))
    throw Error(name, std::string("metadata ") + key + " is no finite number");
  return value;
}

openvdb::FloatGrid::Ptr choose_grid(const openvdb::GridPtrVec& grids, const std::string& name) {
  std::vector<openvdb::FloatGrid::Ptr> floats;
  for (const openvdb::GridBase::Ptr& grid : grids) {
    auto typed = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
    if (typed && grid->getName() == "density")
      return typed;
    if (typed)
      floats.push_back(typed);
  }
  if (floats.size() != 1)
    throw Error(name, std::to_string(floats.size()) +
                          " float grids and none named density, expected a grid 'density'");
  return floats[0];
}

Grid parse_volume(std::string& bytes, const std::string& name, const Context& context) {
  MemoryBuffer buffer(bytes, name);
  std::istream stream(&buffer);
  stream.exceptions(std::ios::badbit | std::ios::failbit | std::ios::eofbit);
  openvdb::io::Stream archive(stream, /*delayLoad=*/false);
  openvdb::FloatGrid::Ptr native = choose_grid(*archive.getGrids(), name);
  GridInfo info;
  info.transform = transform_of(native->transform(), name);
  info.background = native->background();
  info.level_set = native->getGridClass() == openvdb::GRID_LEVEL_SET;
  info.isovalue = number_metadata(*native, isovalue_key, name).value_or(info.level_set ? 0 : 0.5);
  info.band_isovalue = number_metadata(*native, band_key, name);
  const auto storage = std::make_shared<LeafStorage>();
  openvdb::FloatTree::Ptr tree = native->treePtr();
  native.reset(); // the tree has one owner
  Grid grid = make_grid(std::move(info), adopt_tree(std::move(tree), storage), storage);
  if (!grid.summary(context).finite)
    throw Error(name, "a voxel's value is not finite");
  return grid;
}

} // namespace

Grid read_volume(Input& input, const Context& context) {
  return volume_from_bytes(input.read_all(context.max_memory), input.name(), context);
}

Grid volume_from_bytes(std::string bytes, const std::string& name, const Context& context) {
  initialize_openvdb();
  check_vdb_head(bytes, name);
  try {
    return parse_volume(bytes, name, context);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw Error(name, "damaged: asks for more memory than there is");
  } catch (const std::exception& error) {
    throw Error(name, std::string("damaged or no float volume: ") + error.what());
  }
}

void write_volume(Output& output, const Grid& grid, const Context&) {
  initialize_openvdb();
  const GridInfo& info = grid.info();
  const auto native = openvdb::FloatGrid::create(grid.native()->tree);
  native->setTransform(native_transform(info.transform));
  native->setName(info.name);
  native->setGridClass(info.level_set ? openvdb::GRID_LEVEL_SET : openvdb::GRID_FOG_VOLUME);
  if (info.isovalue != (info.level_set ? 0 : 0.5))
    native->insertMeta(isovalue_key, openvdb::DoubleMetadata(info.isovalue));
  if (info.band_isovalue)
    native->insertMeta(band_key, openvdb::DoubleMetadata(*info.band_isovalue));
  UuidBuffer buffer(*output.stream().rdbuf(), uuid_of(grid.digest()));
  std::ostream stream(&buffer);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  openvdb::io::Stream archive(stream);
  archive.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
  archive.write(openvdb::GridCPtrVec{native});
}

} // namespace gewebe
