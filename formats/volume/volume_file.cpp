#include "formats/volume/volume_file_internal.h"

#include "base/digest.h"
#include "base/error.h"
#include "base/parallel.h"
#include "formats/stream/kind.h"
#include "formats/volume/label_volume.h"
#include "volume/grid_internal.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/Stream.h>
#include <openvdb/util/logging.h>
#include <openvdb/version.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <iostream>
#include <istream>
#include <mutex>
#include <optional>
#include <ostream>
#include <sstream>
#include <streambuf>

namespace gewebe::formats {

const StreamWay usual_way =
    openvdb::OPENVDB_FILE_VERSION == openvdb::OPENVDB_FILE_VERSION_MULTIPASS_IO
        ? StreamWay::parallel
        : StreamWay::plain;

namespace {

constexpr std::size_t uuid_begin = 21;
constexpr std::size_t uuid_length = 36;
constexpr const char* isovalue_key = "gewebe_iso";
constexpr const char* band_key = "gewebe_band_iso";
constexpr const char* space_key = "gewebe_space";

void initialize_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] {
    openvdb::logging::setLevel(openvdb::logging::Level::Fatal);
    openvdb::initialize();
    // Lists the places of leaves, for readers that load on demand. Its lengths need a check, and
    // nothing here needs it: as metadata of an unknown type it is ignored.
    openvdb::Metadata::unregisterType(openvdb::io::DelayedLoadMetadata::staticTypeName());
  });
}

/// What OpenVDB says while it reads: its library logs to standard output, its headers to standard
/// error, and neither throws. While this object lives, it is kept here instead.
class Remarks {
public:
  Remarks() : cout_(std::cout.rdbuf(&kept_)), cerr_(std::cerr.rdbuf(&kept_)) {}
  Remarks(const Remarks&) = delete;
  Remarks& operator=(const Remarks&) = delete;
  ~Remarks() {
    (void)std::cout.rdbuf(cout_);
    (void)std::cerr.rdbuf(cerr_);
  }
  /// All that was said.
  std::string text() { return kept_.text(); }

private:
  /// Several threads may speak at once.
  class Kept final : public std::streambuf {
  public:
    std::string text() {
      const std::lock_guard lock(mutex_);
      return text_;
    }

  private:
    int_type overflow(int_type c) override {
      const std::lock_guard lock(mutex_);
      if (!traits_type::eq_int_type(c, traits_type::eof()))
        text_ += traits_type::to_char_type(c);
      return traits_type::not_eof(c);
    }
    std::streamsize xsputn(const char* data, std::streamsize count) override {
      const std::lock_guard lock(mutex_);
      text_.append(data, static_cast<std::size_t>(count));
      return count;
    }
    std::mutex mutex_;
    std::string text_;
  };

  Kept kept_;
  std::streambuf* cout_;
  std::streambuf* cerr_;
};

/// Bytes in memory as a stream that throws where it ends: OpenVDB takes what a short read left in
/// its buffers for data.
class MemoryBuffer final : public std::streambuf {
public:
  MemoryBuffer(std::string_view bytes, const std::string& name) : name_(name) {
    auto* const begin = const_cast<char*>(bytes.data()); // streambuf requires it, nothing writes
    setg(begin, begin, begin + bytes.size());
  }
  [[noreturn]] void fail() const {
    throw Error(name_, "byte " + std::to_string(egptr() - eback()) + ": ends early");
  }
  std::string_view all() const { return {eback(), static_cast<std::size_t>(egptr() - eback())}; }
  std::string_view rest() const { return {gptr(), static_cast<std::size_t>(egptr() - gptr())}; }
  void skip(std::size_t count) { setg(eback(), gptr() + count, egptr()); }
  const std::string& name() const { return name_; }

private:
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

// ---- leaves, many at a time

constexpr std::size_t leaves_at_once = 64;

constexpr std::uint32_t flags_of(Packing packing) {
  return packing == Packing::blosc ? openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK
                                   : openvdb::io::COMPRESS_ACTIVE_MASK;
}

Context without_progress(const Context& context) {
  Context quiet = context;
  quiet.progress = nullptr;
  return quiet;
}

/// Values of a leaf with this mask and byte.
std::size_t values_in(const char* mask, char kind) {
  if (kind == openvdb::io::NO_MASK_AND_ALL_VALS)
    return volume::leaf_voxels;
  std::array<std::uint64_t, volume::leaf_voxels / 64> words{};
  std::memcpy(words.data(), mask, sizeof words);
  std::size_t count = 0;
  for (const std::uint64_t word : words)
    count += static_cast<std::size_t>(std::popcount(word));
  return count;
}

/// Bytes of the first leaf in `bytes`, as OpenVDB writes it since file version 222 with these
/// flags: a mask, a byte that says which inactive values follow, they, a mask that chooses between
/// them, then the values: of all voxels if the byte says so, else of those that are active; by
/// blosc the number of compressed bytes (negative: raw ones) and the bytes.
std::size_t leaf_bytes(const MemoryBuffer& buffer, std::string_view bytes, Packing packing) {
  constexpr std::size_t mask = volume::leaf_voxels / 8;
  const auto need = [&](std::size_t count) {
    if (count > bytes.size())
      buffer.fail();
  };
  need(mask + 1);
  std::size_t size = mask + 1;
  using namespace openvdb::io;
  switch (static_cast<int>(bytes[mask])) {
  case NO_MASK_OR_INACTIVE_VALS:
  case NO_MASK_AND_MINUS_BG:
  case NO_MASK_AND_ALL_VALS:
    break;
  case NO_MASK_AND_ONE_INACTIVE_VAL:
    size += sizeof(float);
    break;
  case MASK_AND_NO_INACTIVE_VALS:
    size += mask;
    break;
  case MASK_AND_ONE_INACTIVE_VAL:
    size += sizeof(float) + mask;
    break;
  case MASK_AND_TWO_INACTIVE_VALS:
    size += 2 * sizeof(float) + mask;
    break;
  default:
    throw Error(buffer.name(), "byte " + std::to_string(bytes.data() + mask - buffer.all().data()) +
                                   ": unknown kind of leaf");
  }
  if (packing == Packing::none) {
    size += sizeof(float) * values_in(bytes.data(), bytes[mask]);
    need(size);
    return size;
  }
  std::int64_t count = 0;
  need(size + sizeof count);
  std::memcpy(&count, bytes.data() + size, sizeof count);
  size += sizeof count;
  if (count > static_cast<std::int64_t>(bytes.size()) || -count > volume::leaf_voxels * 4)
    buffer.fail();
  size += static_cast<std::size_t>(count < 0 ? -count : count);
  need(size);
  return size;
}

/// A grid whose leaves are read in parallel, with all their values in one block of memory. Without
/// a packing OpenVDB reads them.
class ReadGrid final : public openvdb::FloatGrid {
public:
  ReadGrid(const Context& context, const std::shared_ptr<volume::LeafStorage>& storage,
           std::optional<Packing> packing)
      : openvdb::FloatGrid(volume::make_tree(0, storage)), context_(without_progress(context)),
        storage_(storage), packing_(packing) {}

  void readBuffers(std::istream& stream) override {
    std::vector<volume::FloatLeaf*> leaves;
    leaves.reserve(tree().leafCount());
    tree().getNodes(leaves);
    double bytes = static_cast<double>(leaves.size()) * volume::leaf_voxels * sizeof(float);
    for (const ZeroPages& pages : storage_->pages) // of grids before it
      bytes += static_cast<double>(pages.size());
    require_memory(context_, bytes, "the volume");
    if (!packing_) {
      openvdb::FloatGrid::readBuffers(stream);
      return;
    }
    auto& buffer = dynamic_cast<MemoryBuffer&>(*stream.rdbuf());
    std::vector<std::string_view> parts; // one for each block of leaves
    std::size_t done = 0;
    for (std::size_t n = 0; n < leaves.size(); ++n) {
      if (n % leaves_at_once == 0)
        parts.push_back(buffer.rest().substr(done, 0));
      const std::size_t size = leaf_bytes(buffer, buffer.rest().substr(done), *packing_);
      done += size;
      parts.back() = {parts.back().data(), parts.back().size() + size};
    }
    buffer.skip(done);

    auto* const values = reinterpret_cast<float*>(
        storage_->pages.emplace_back(leaves.size() * volume::leaf_voxels * sizeof(float)).data());
    const auto metadata = openvdb::io::getStreamMetadataPtr(stream);
    parallel_blocks(context_, leaves.size(), leaves_at_once,
                    [&](std::size_t begin, std::size_t end) {
                      MemoryBuffer part_buffer(parts[begin / leaves_at_once], buffer.name());
                      std::istream part(&part_buffer);
                      part.copyfmt(stream); // what OpenVDB knows of the stream is kept there
                      auto own = std::make_shared<openvdb::io::StreamMetadata>(*metadata);
                      openvdb::io::setStreamMetadataPtr(part, own, /*transfer=*/false);
                      for (std::size_t n = begin; n < end; ++n) {
                        volume::borrow_values(*leaves[n], values + n * volume::leaf_voxels);
                        leaves[n]->readBuffers(part, /*fromHalf=*/false);
                      }
                    });
  }
  using openvdb::FloatGrid::readBuffers;

private:
  Context context_;
  std::shared_ptr<volume::LeafStorage> storage_;
  std::optional<Packing> packing_;
};

/// Reads the float grids of a stream and passes over the others. Each length that OpenVDB would
/// believe is compared with the bytes that are there.
class ReadArchive final : public openvdb::io::Archive {
public:
  openvdb::GridPtrVec read(MemoryBuffer& buffer, const Context& context,
                           const std::shared_ptr<volume::LeafStorage>& storage, StreamWay way) {
    std::istream stream(&buffer);
    stream.exceptions(std::ios::badbit | std::ios::failbit | std::ios::eofbit);
    readHeader(stream);
    auto metadata = std::make_shared<openvdb::io::StreamMetadata>();
    openvdb::io::setStreamMetadataPtr(stream, metadata, /*transfer=*/false);
    setFormatVersion(stream);
    setLibraryVersion(stream);
    setDataCompression(stream);
    openvdb::MetaMap ignored;
    ignored.readMeta(stream);
    openvdb::GridPtrVec grids;
    NamedGridMap named;
    for (std::int32_t left = readGridCount(stream); left > 0; --left) {
      check_vdb_grid(buffer.all(), position(stream), buffer.name());
      openvdb::io::GridDescriptor descriptor;
      openvdb::GridBase::Ptr grid = descriptor.read(stream);
      const bool is_float = descriptor.gridType() == openvdb::FloatGrid::gridType();
      if (!is_float && inputHasGridOffsets()) {
        const std::int64_t end = descriptor.getEndPos();
        if (end <= static_cast<std::int64_t>(position(stream)))
          throw Error(buffer.name(), "byte " + std::to_string(position(stream)) +
                                         ": the grid ends before it begins");
        stream.seekg(end);
        continue;
      }
      if (!is_float)
        refuse_lengths(descriptor, buffer.name());
      else {
        grid = std::make_shared<ReadGrid>(context, storage, packing_ahead(stream, way));
        grid->setSaveFloatAsHalf(descriptor.saveFloatAsHalf());
      }
      readGrid(grid, descriptor, stream);
      if (descriptor.isInstance()) {
        if (named.find(descriptor.instanceParentName()) == named.end())
          throw Error(buffer.name(), "a grid shares the tree of one that is not there");
        connectInstance(descriptor, named);
      }
      named[descriptor.uniqueName()] = grid;
      grids.push_back(grid);
    }
    return grids;
  }

private:
  static std::size_t position(std::istream& stream) {
    return static_cast<std::size_t>(static_cast<std::streamoff>(stream.tellg()));
  }

  /// Trees of points and of strings hold lengths of their own.
  static void refuse_lengths(const openvdb::io::GridDescriptor& descriptor,
                             const std::string& name) {
    const std::string& type = descriptor.gridType();
    if (type.find("ptdata") != std::string::npos || type.find("string") != std::string::npos)
      throw Error(name, "a grid of type " + type +
                            " cannot be passed over in a stream, expected grids of numbers");
  }

  /// How the leaves of the grid that follows are packed, if this file's reader can unpack them.
  static std::optional<Packing> packing_ahead(std::istream& stream, StreamWay way) {
    if (way != StreamWay::parallel)
      return std::nullopt;
    const auto begin = stream.tellg();
    readGridCompression(stream);
    const std::uint32_t flags = openvdb::io::getDataCompression(stream);
    stream.seekg(begin);
    if (flags == flags_of(Packing::blosc))
      return Packing::blosc;
    if (flags == flags_of(Packing::none))
      return Packing::none;
    return std::nullopt;
  }
};

/// Memory that is written again and again; a string stream gives its own back each time.
class PartBuffer final : public std::streambuf {
public:
  void clear() { used_ = 0; }
  std::string_view view() const { return {bytes_.data(), used_}; }

private:
  int_type overflow(int_type c) override {
    if (traits_type::eq_int_type(c, traits_type::eof()))
      return traits_type::not_eof(c);
    const char byte = traits_type::to_char_type(c);
    (void)xsputn(&byte, 1);
    return c;
  }
  std::streamsize xsputn(const char* data, std::streamsize count) override {
    const auto size = static_cast<std::size_t>(count);
    if (bytes_.size() - used_ < size)
      bytes_.resize(std::max(2 * bytes_.size(), used_ + size));
    std::memcpy(bytes_.data() + used_, data, size);
    used_ += size;
    return count;
  }

  std::vector<char> bytes_;
  std::size_t used_ = 0;
};

/// A grid whose leaves are packed in parallel; the bytes are the same.
class WriteGrid final : public openvdb::FloatGrid {
public:
  WriteGrid(openvdb::FloatTree::Ptr tree, const Context& context)
      : openvdb::FloatGrid(std::move(tree)), context_(without_progress(context)) {}

  void writeBuffers(std::ostream& stream) const override {
    std::vector<const volume::FloatLeaf*> leaves;
    leaves.reserve(tree().leafCount());
    tree().getNodes(leaves);
    const auto metadata = openvdb::io::getStreamMetadataPtr(stream);
    // So many blocks of leaves are held at once that all threads have work.
    const std::size_t batch = leaves_at_once * 64;
    std::vector<PartBuffer> parts;
    for (std::size_t first = 0; first < leaves.size(); first += batch) {
      const std::size_t count = std::min(batch, leaves.size() - first);
      parts.resize(std::max(parts.size(), (count + leaves_at_once - 1) / leaves_at_once));
      parallel_blocks(context_, count, leaves_at_once, [&](std::size_t begin, std::size_t end) {
        PartBuffer& buffer = parts[begin / leaves_at_once];
        buffer.clear();
        std::ostream part(&buffer);
        part.copyfmt(stream); // what OpenVDB knows of the stream is kept there
        auto own = std::make_shared<openvdb::io::StreamMetadata>(*metadata);
        openvdb::io::setStreamMetadataPtr(part, own, /*transfer=*/false);
        for (std::size_t n = begin; n < end; ++n)
          leaves[first + n]->writeBuffers(part, /*toHalf=*/false);
      });
      for (std::size_t n = 0; n < count; n += leaves_at_once) {
        const std::string_view part = parts[n / leaves_at_once].view();
        stream.write(part.data(), static_cast<std::streamsize>(part.size()));
      }
    }
  }

private:
  Context context_;
};

/// A stream with one grid. OpenVDB's own writer compresses all leaves twice, the first time to tell
/// their sizes to readers that load on demand.
class WriteArchive final : public openvdb::io::Archive {
public:
  void write_grid(std::ostream& stream, const WriteGrid& grid, Packing packing) {
    setCompression(flags_of(packing));
    auto metadata = std::make_shared<openvdb::io::StreamMetadata>();
    openvdb::io::setStreamMetadataPtr(stream, metadata, /*transfer=*/false);
    writeHeader(stream, /*seekable=*/false);
    openvdb::MetaMap().writeMeta(stream);
    const std::int32_t count = 1;
    stream.write(reinterpret_cast<const char*>(&count), sizeof count);
    const openvdb::io::GridDescriptor descriptor(grid.getName(), grid.type());
    descriptor.writeHeader(stream);
    descriptor.writeStreamPos(stream);
    setGridCompression(stream, grid);
    grid.writeMeta(stream);
    grid.writeTransform(stream);
    grid.writeTopology(stream);
    grid.writeBuffers(stream);
  }
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

volume::GridTransform transform_of(const openvdb::math::Transform& transform,
                                   const std::string& name) {
  if (!transform.isLinear())
    throw Error(name, "the grid has a frustum transform, expected an affine one");
  const openvdb::Mat4R matrix = transform.baseMap()->getAffineMap()->getMat4();
  volume::GridTransform result; // OpenVDB multiplies row vectors from the left
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

openvdb::math::Transform::Ptr native_transform(const volume::GridTransform& transform) {
  const auto& m = transform.m;
  if (transform == volume::uniform_transform(m[0]))
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

Space space_metadata(const openvdb::GridBase& grid, const std::string& name) {
  const openvdb::Metadata::ConstPtr metadata = grid[space_key];
  if (!metadata)
    return Space::unknown;
  const auto* const text = dynamic_cast<const openvdb::StringMetadata*>(metadata.get());
  const Space space = text == nullptr ? Space::unknown : space_from_name(text->value());
  if (space == Space::unknown)
    throw Error(name, std::string("metadata ") + space_key + " is no space, expected RAS or LPS");
  return space;
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

volume::Grid parse_volume(std::string_view bytes, const std::string& name, const Context& context,
                          StreamWay way, Space* space) {
  MemoryBuffer buffer(bytes, name);
  const auto storage = std::make_shared<volume::LeafStorage>();
  openvdb::FloatGrid::Ptr native =
      choose_grid(ReadArchive().read(buffer, context, storage, way), name);
  openvdb::FloatTree::Ptr tree = native->treePtr();
  volume::GridInfo info;
  info.transform = transform_of(native->transform(), name);
  info.background = native->background();
  info.level_set = native->getGridClass() == openvdb::GRID_LEVEL_SET;
  info.isovalue = number_metadata(*native, isovalue_key, name).value_or(info.level_set ? 0 : 0.5);
  info.band_isovalue = number_metadata(*native, band_key, name);
  if (space != nullptr)
    *space = space_metadata(*native, name);
  native.reset(); // the tree has one owner
  volume::Grid grid = volume::make_grid(std::move(info), std::move(tree), storage);
  if (!grid.summary(context).finite)
    throw Error(name, "a voxel's value is not finite");
  return grid;
}

/// Message for a damaged volume, from OpenVDB's exception or log.
std::string fault_of(std::string_view remark) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 7> faults{{
      {"multi-buffer", "the grid's tree has several buffers, expected one"},
      {"Map ", "the grid's transform is of an unknown kind, expected an affine one"},
      {"nregistered type", "the stream holds a grid of an unknown type, expected float grids"},
      {"rid type ", "the stream holds a grid of an unknown type, expected float grids"},
      {"-byte chunk", "a packed block is damaged: it has another size than is said"},
      {"decompress", "a packed block is damaged: it does not unpack"},
      {"ncoding is not supported",
       "the volume is packed in a way that this system's OpenVDB lacks"},
  }};
  for (const auto& [words, fault] : faults)
    if (remark.find(words) != std::string_view::npos)
      return std::string(fault);
  return "is damaged or of a kind that this program does not read";
}

/// What other programs make volumes of is named, with the program.
void refuse_other_kinds(std::string_view bytes, const std::string& name) {
  const std::string_view first = bytes.substr(0, 4096);
  if (is_label_volume(first))
    throw Error(name, "is a label volume or a scan, expected an OpenVDB volume: voxelize --label L "
                      "or --threshold LOW makes one of it");
  switch (kind_from_magic(first)) {
  case Kind::ply:
  case Kind::glb:
  case Kind::vtp:
    throw Error(name, "is a mesh, expected an OpenVDB volume: voxelize makes one of it");
  case Kind::ela:
    throw Error(name, "is a model, expected an OpenVDB volume: exp2ela --to ply writes its "
                      "surface, voxelize makes a volume of that");
  default:
    break;
  }
}

} // namespace

volume::Grid read_volume(Input& input, const Context& context, Space* space) {
  return volume_from_bytes(input.read_all_pages(context.max_memory).view(), input.name(), context,
                           space);
}

volume::Grid volume_from_bytes(std::string_view bytes, const std::string& name,
                               const Context& context, Space* space) {
  return volume_from_bytes(bytes, name, context, usual_way, space);
}

volume::Grid volume_from_bytes(std::string_view bytes, const std::string& name,
                               const Context& context, StreamWay way, Space* space) {
  initialize_openvdb();
  refuse_other_kinds(bytes, name);
  check_vdb_head(bytes, name);
  Remarks remarks;
  try {
    volume::Grid grid =
        gewebe::at(name, [&] { return parse_volume(bytes, name, context, way, space); });
    if (const std::string remark = remarks.text(); !remark.empty())
      throw Error(name, fault_of(remark));
    return grid;
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw Error(name, "is damaged, or there is less memory than it needs");
  } catch (const std::exception& error) {
    throw Error(name, fault_of(error.what()));
  }
}

void write_volume(Output& output, const volume::Grid& grid, const Context& context, Packing packing,
                  Space space) {
  write_volume(output, grid, context, packing, usual_way, space);
}

void write_volume(Output& output, const volume::Grid& grid, const Context& context, Packing packing,
                  StreamWay way, Space space) {
  initialize_openvdb();
  const volume::GridInfo& info = grid.info();
  const auto native = std::make_shared<WriteGrid>(grid.native()->tree, context);
  native->setTransform(native_transform(info.transform));
  native->setName(info.name);
  native->setGridClass(info.level_set ? openvdb::GRID_LEVEL_SET : openvdb::GRID_FOG_VOLUME);
  if (info.isovalue != (info.level_set ? 0 : 0.5))
    native->insertMeta(isovalue_key, openvdb::DoubleMetadata(info.isovalue));
  if (info.band_isovalue)
    native->insertMeta(band_key, openvdb::DoubleMetadata(*info.band_isovalue));
  if (space != Space::unknown)
    native->insertMeta(space_key, openvdb::StringMetadata(std::string(space_name(space))));
  native->addStatsMetadata(); // as OpenVDB does
  native->insertMeta(openvdb::GridBase::META_FILE_COMPRESSION,
                     openvdb::StringMetadata(openvdb::io::compressionToString(flags_of(packing))));
  UuidBuffer buffer(*output.stream().rdbuf(), uuid_of(grid.digest()));
  std::ostream stream(&buffer);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  if (way == StreamWay::parallel) {
    WriteArchive().write_grid(stream, *native, packing);
    return;
  }
  openvdb::io::Stream archive(stream);
  archive.setCompression(flags_of(packing));
  archive.write(openvdb::GridCPtrVec{std::make_shared<openvdb::FloatGrid>(*native)});
}

} // namespace gewebe::formats
