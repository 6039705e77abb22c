#include "formats/store/hdf5_internal.h"

#include "base/error.h"
#include "formats/store/checkpoint_driver_internal.h"
#include "formats/stream/file_names.h"

#define H5_USE_110_API // later versions keep its names
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <sys/stat.h>

namespace gewebe::formats::hdf5 {

static_assert(std::is_same_v<hid_t, std::int64_t>);

namespace {

constexpr std::size_t max_text = 65536;       // bytes of an attribute
constexpr unsigned max_rank = 8;              // of an array
constexpr std::uint64_t max_chunk = 1U << 20; // bytes that are kept together

/// Before anything else. What the library does at exit with a file that it could not write (a full
/// disk) ends in a crash, and files are closed here, so it must leave exits alone.
void silence() {
  (void)H5dont_atexit();
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

// In the order of Number.
hid_t file_type(Number type) {
  const std::array<hid_t, 7> types{H5T_IEEE_F64LE, H5T_IEEE_F32LE, H5T_STD_I64LE, H5T_STD_U64LE,
                                   H5T_STD_I32LE,  H5T_STD_U32LE,  H5T_STD_U8LE};
  return types.at(static_cast<std::size_t>(type));
}

hid_t memory_type(Number type) {
  const std::array<hid_t, 7> types{H5T_NATIVE_DOUBLE, H5T_NATIVE_FLOAT, H5T_NATIVE_INT64,
                                   H5T_NATIVE_UINT64, H5T_NATIVE_INT32, H5T_NATIVE_UINT32,
                                   H5T_NATIVE_UINT8};
  return types.at(static_cast<std::size_t>(type));
}

const char* type_name(Number type) {
  constexpr std::array<const char*, 7> names{"float64", "float32", "int64", "uint64",
                                             "int32",   "uint32",  "uint8"};
  return names.at(static_cast<std::size_t>(type));
}

/// Whether a type in a file is this one, whatever its byte order.
bool is_type(hid_t type, Number number) {
  return H5Tequal(type, file_type(number)) > 0;
}

std::string shape_text(const Shape& shape) {
  std::string text = "[";
  for (const std::uint64_t size : shape)
    text += (text.size() > 1 ? ", " : "") + std::to_string(size);
  return text + "]";
}

/// What the system said, dug out of the library's own messages.
std::string system_reason() {
  std::string reason;
  const auto look = [](unsigned, const H5E_error2_t* error, void* data) -> herr_t {
    const char* const text = error->desc != nullptr ? error->desc : "";
    const char* begin = std::strstr(text, "error message = '");
    if (begin != nullptr) {
      begin += std::strlen("error message = '");
      const char* const end = std::strchr(begin, '\'');
      if (end != nullptr)
        static_cast<std::string*>(data)->assign(begin, end);
    }
    return 0;
  };
  (void)H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, look, &reason);
  (void)H5Eclear2(H5E_DEFAULT);
  return reason.empty() ? "" : ": " + reason;
}

/// Product of the sizes. \throw Error if it is beyond 2^62 bytes
std::uint64_t bytes_of(const Shape& shape, Number type, const Object& where) {
  std::uint64_t bytes = size_of(type);
  for (const std::uint64_t size : shape)
    if (__builtin_mul_overflow(bytes, size, &bytes) || bytes > std::uint64_t{1} << 62)
      where.fail("an array of shape " + shape_text(shape) + " is too large");
  return bytes;
}

std::vector<hsize_t> dims_of(const Shape& shape) {
  return {shape.begin(), shape.end()};
}

/// Properties of what is made: no time stamps.
Handle properties(hid_t what) {
  Handle made(H5Pcreate(what));
  (void)H5Pset_obj_track_times(made.id(), false);
  return made;
}

Handle access() {
  Handle made(H5Pcreate(H5P_FILE_ACCESS));
  (void)H5Pset_libver_bounds(made.id(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  (void)H5Pset_fclose_degree(made.id(), H5F_CLOSE_STRONG);
  (void)H5Pset_file_locking(made.id(), false, true);
  return made;
}

Handle text_type(std::size_t size) {
  Handle type(H5Tcopy(H5T_C_S1));
  (void)H5Tset_size(type.id(), std::max<std::size_t>(size, 1));
  (void)H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  (void)H5Tset_cset(type.id(), H5T_CSET_UTF8);
  return type;
}

/// Bytes of a fixed-length text type, 0 if it is anything else.
std::size_t text_size(hid_t type) {
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0)
    return 0;
  return H5Tget_size(type);
}

std::string until_zero(const char* text, std::size_t size) {
  return {text, strnlen(text, size)};
}

Shape shape_of(hid_t space, const Object& where) {
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank < 0 || rank > static_cast<int>(max_rank) || H5Sis_simple(space) <= 0 ||
      H5Sget_simple_extent_type(space) == H5S_NULL)
    where.fail("is no array of numbers");
  std::vector<hsize_t> dims(static_cast<std::size_t>(rank));
  if (rank > 0 && H5Sget_simple_extent_dims(space, dims.data(), nullptr) < 0)
    where.fail("is no array of numbers");
  return {dims.begin(), dims.end()};
}

} // namespace

std::size_t size_of(Number type) noexcept {
  switch (type) {
  case Number::float64:
  case Number::int64:
  case Number::uint64:
    return 8;
  case Number::uint8:
    return 1;
  default:
    return 4;
  }
}

std::string link_name(std::string_view name) {
  std::string result(name);
  std::replace(result.begin(), result.end(), '/', '_');
  std::replace(result.begin(), result.end(), '\0', '_');
  if (result.find_first_not_of('.') == std::string::npos)
    result = "_" + std::string(result.size(), '_');
  return result;
}

// ---- Handle

Handle::~Handle() {
  if (id_ >= 0)
    (void)H5Idec_ref(id_);
}

Handle& Handle::operator=(Handle&& other) noexcept {
  std::swap(id_, other.id_);
  return *this;
}

// ---- Object

void Object::fail(const std::string& what) const {
  throw Error(file_->path, "'" + name_ + "': " + what);
}

void Object::fail_write(const std::string& what) const {
  const std::string reason = system_reason();
  file_->failed = true;
  fail(what + reason);
}

Object::~Object() {
  const std::int64_t id = handle_.release();
  if (id < 0 || file_->gone())
    return;
  // What was still in memory is written now.
  if (H5Idec_ref(id) < 0 && file_->writing) {
    file_->failed = true;
    try {
      file_->reason = system_reason();
    } catch (...) {
      (void)file_->failed; // the reason alone is lost
    }
  }
}

bool Object::has_attribute(const std::string& name) const {
  return H5Aexists(handle_.id(), name.c_str()) > 0;
}

void Object::set(const std::string& name, std::string_view text) {
  std::string padded(text);
  padded.resize(std::max<std::size_t>(padded.size(), 1));
  if (padded.size() > max_text - 1024) // what an object header holds
    fail("attribute " + name + " is too long");
  const Handle type = text_type(padded.size());
  const Handle space(H5Screate(H5S_SCALAR));
  const Handle attribute(
      H5Acreate2(handle_.id(), name.c_str(), type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT));
  if (attribute.id() < 0 || H5Awrite(attribute.id(), type.id(), padded.data()) < 0)
    fail_write("attribute " + name + " cannot be written");
}

void Object::set_numbers(const std::string& name, Number type, const void* values,
                         const std::uint64_t* count) {
  const hsize_t size = count != nullptr ? *count : 1;
  const Handle space(count != nullptr ? H5Screate_simple(1, &size, nullptr)
                                      : H5Screate(H5S_SCALAR));
  const Handle attribute(H5Acreate2(handle_.id(), name.c_str(), file_type(type), space.id(),
                                    H5P_DEFAULT, H5P_DEFAULT));
  if (attribute.id() < 0 || H5Awrite(attribute.id(), memory_type(type), values) < 0)
    fail_write("attribute " + name + " cannot be written");
}

void Object::replace_number(const std::string& name, Number type, const void* value) {
  const Handle attribute(H5Aopen(handle_.id(), name.c_str(), H5P_DEFAULT));
  if (attribute.id() < 0 || H5Awrite(attribute.id(), memory_type(type), value) < 0)
    fail_write("attribute " + name + " cannot be written");
}

std::string Object::text(const std::string& name) const {
  const Handle attribute(H5Aopen(handle_.id(), name.c_str(), H5P_DEFAULT));
  if (attribute.id() < 0)
    fail("no attribute " + name + ", expected a text");
  const Handle type(H5Aget_type(attribute.id()));
  const Handle space(H5Aget_space(attribute.id()));
  const std::size_t size = text_size(type.id());
  if (size == 0 || size > max_text || H5Sget_simple_extent_npoints(space.id()) != 1)
    fail("attribute " + name + " is no text of fixed length");
  std::string text(size, '\0');
  if (H5Aread(attribute.id(), type.id(), text.data()) < 0)
    fail("attribute " + name + " cannot be read" + system_reason());
  return until_zero(text.data(), size);
}

void Object::get_numbers(const std::string& name, Number type, void* values,
                         std::size_t count) const {
  const Handle attribute(H5Aopen(handle_.id(), name.c_str(), H5P_DEFAULT));
  if (attribute.id() < 0)
    fail("no attribute " + name + ", expected " + type_name(type));
  const Handle found(H5Aget_type(attribute.id()));
  const Handle space(H5Aget_space(attribute.id()));
  if (!is_type(found.id(), type) ||
      H5Sget_simple_extent_npoints(space.id()) != static_cast<hssize_t>(count))
    fail("attribute " + name + " is not what was expected: " + std::to_string(count) + " " +
         type_name(type));
  if (H5Aread(attribute.id(), memory_type(type), values) < 0)
    fail("attribute " + name + " cannot be read" + system_reason());
}

// ---- Dataset

Dataset::Dataset(Handle handle, std::shared_ptr<FileState> file, std::string name, Shape shape,
                 Number type)
    : Object(std::move(handle), std::move(file), std::move(name)), shape_(std::move(shape)),
      type_(type) {
  for (std::size_t i = 1; i < shape_.size(); ++i)
    row_size_ *= shape_[i]; // the whole was checked by bytes_of
}

void Dataset::require_shape(const Shape& shape) const {
  if (shape_ != shape)
    fail("has shape " + shape_text(shape_) + ", expected " + shape_text(shape));
}

std::uint64_t Dataset::offset() const {
  const haddr_t offset = H5Dget_offset(handle_.id());
  if (offset == HADDR_UNDEF)
    fail("has no place in the file");
  return offset;
}

void Dataset::grow(std::size_t values) {
  if (row_size_ == 0 || values % row_size_ != 0)
    fail(std::to_string(values) + " numbers, expected rows of " + std::to_string(row_size_));
  Shape larger = shape_;
  larger[0] += values / row_size_;
  (void)bytes_of(larger, type_, *this);
  if (H5Dset_extent(handle_.id(), dims_of(larger).data()) < 0)
    fail_write("cannot grow");
  shape_ = std::move(larger);
}

std::pair<Handle, Handle> Dataset::select(std::uint64_t first, std::size_t values,
                                          Number type) const {
  const std::uint64_t count = row_size_ == 0 ? 0 : values / row_size_;
  if (type != type_ || (row_size_ != 0 && values % row_size_ != 0) || first > rows() ||
      count > rows() - first)
    fail(std::to_string(values) + " numbers of type " + type_name(type) + " from row " +
         std::to_string(first) + " on, but it is " + type_name(type_) + shape_text(shape_));
  std::vector<hsize_t> start(shape_.size()), extent = dims_of(shape_);
  Handle file(H5Dget_space(handle_.id()));
  const hsize_t all = values;
  Handle memory(H5Screate_simple(1, &all, nullptr));
  if (!shape_.empty()) {
    start[0] = first;
    extent[0] = count;
    if (H5Sselect_hyperslab(file.id(), H5S_SELECT_SET, start.data(), nullptr, extent.data(),
                            nullptr) < 0)
      fail("cannot be addressed");
  }
  return {std::move(memory), std::move(file)};
}

void Dataset::transfer_write(Number type, std::uint64_t first, const void* values,
                             std::size_t count) {
  const auto [memory, file] = select(first, count, type);
  if (count == 0)
    return;
  if (H5Dwrite(handle_.id(), memory_type(type), memory.id(), file.id(), H5P_DEFAULT, values) < 0)
    fail_write("cannot be written");
}

void Dataset::transfer_read(Number type, std::uint64_t first, void* values,
                            std::size_t count) const {
  const auto [memory, file] = select(first, count, type);
  if (count == 0)
    return;
  if (H5Dread(handle_.id(), memory_type(type), memory.id(), file.id(), H5P_DEFAULT, values) < 0)
    fail("cannot be read" + system_reason());
}

// ---- Group

std::string Group::path_of(const std::string& name) const {
  return name_ == "/" ? name_ + name : name_ + "/" + name;
}

bool Group::has(const std::string& name) const {
  // A name that isn't one link, and links that lead elsewhere, don't count.
  if (name.empty() || name.find('/') != std::string::npos || name == ".")
    return false;
  H5L_info_t info;
  return H5Lexists(handle_.id(), name.c_str(), H5P_DEFAULT) > 0 &&
         H5Lget_info(handle_.id(), name.c_str(), &info, H5P_DEFAULT) >= 0 &&
         info.type == H5L_TYPE_HARD;
}

std::vector<std::string> Group::groups() const {
  H5G_info_t info;
  if (H5Gget_info(handle_.id(), &info) < 0)
    fail("cannot be listed" + system_reason());
  std::vector<std::string> found;
  struct Visit {
    std::vector<std::string>* found;
    bool too_many;
  } visit{&found, false};
  const auto look = [](hid_t group, const char* name, const H5L_info_t* link,
                       void* data) -> herr_t {
    auto* const to = static_cast<Visit*>(data);
    H5O_info_t object;
    if (link->type != H5L_TYPE_HARD)
      return 0;
    if (H5Oget_info_by_name2(group, name, &object, H5O_INFO_BASIC, H5P_DEFAULT) < 0)
      return -1;
    if (object.type != H5O_TYPE_GROUP)
      return 0;
    try {
      to->found->emplace_back(name);
    } catch (...) {
      to->too_many = true; // nothing may fly through the library
      return -1;
    }
    return 0;
  };
  hsize_t at = 0;
  const herr_t status = H5Literate(handle_.id(), H5_INDEX_NAME, H5_ITER_INC, &at, look, &visit);
  if (visit.too_many)
    throw std::bad_alloc();
  if (status < 0)
    fail("cannot be listed" + system_reason());
  return found;
}

Group Group::group(const std::string& name) const {
  Handle handle(has(name) ? H5Gopen2(handle_.id(), name.c_str(), H5P_DEFAULT) : -1);
  if (handle.id() < 0)
    fail("no group '" + name + "', expected one");
  return {std::move(handle), file_, path_of(name)};
}

Group Group::create_group(const std::string& name) {
  const Handle made = properties(H5P_GROUP_CREATE);
  Handle handle(H5Gcreate2(handle_.id(), name.c_str(), H5P_DEFAULT, made.id(), H5P_DEFAULT));
  if (handle.id() < 0)
    fail_write("group '" + name + "' cannot be made");
  return {std::move(handle), file_, path_of(name)};
}

Dataset Group::create_dataset(const std::string& name, Number type, const Shape& shape) {
  (void)bytes_of(shape, type, *this);
  const Handle made = properties(H5P_DATASET_CREATE);
  (void)H5Pset_layout(made.id(), H5D_CONTIGUOUS);
  (void)H5Pset_alloc_time(made.id(), H5D_ALLOC_TIME_EARLY);
  (void)H5Pset_fill_time(made.id(), H5D_FILL_TIME_NEVER);
  const std::vector<hsize_t> dims = dims_of(shape);
  const Handle space(shape.empty()
                         ? H5Screate(H5S_SCALAR)
                         : H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr));
  Handle handle(H5Dcreate2(handle_.id(), name.c_str(), file_type(type), space.id(), H5P_DEFAULT,
                           made.id(), H5P_DEFAULT));
  if (handle.id() < 0)
    fail_write("dataset '" + name + "' cannot be made");
  return {std::move(handle), file_, path_of(name), shape, type};
}

Dataset Group::create_growing(const std::string& name, Number type, const Shape& row_shape,
                              std::uint64_t rows_per_chunk) {
  Shape shape{0};
  shape.insert(shape.end(), row_shape.begin(), row_shape.end());
  Shape row{1};
  row.insert(row.end(), row_shape.begin(), row_shape.end());
  const std::uint64_t bytes = bytes_of(row, type, *this);
  if (bytes == 0)
    fail("dataset '" + name + "': rows of shape " + shape_text(row_shape) + " hold nothing");
  // A chunk holds whole rows, or a part of one along its slowest index.
  std::vector<hsize_t> chunk = dims_of(row);
  chunk[0] = std::max<std::uint64_t>(1, std::min(rows_per_chunk, max_chunk / bytes));
  if (chunk.size() > 1 && bytes > max_chunk)
    chunk[1] = std::max<std::uint64_t>(1, chunk[1] / ((bytes - 1) / max_chunk + 1));
  const Handle made = properties(H5P_DATASET_CREATE);
  std::vector<hsize_t> dims = dims_of(shape), max_dims = dims;
  max_dims[0] = H5S_UNLIMITED;
  const Handle space(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), max_dims.data()));
  Handle handle(-1);
  if (H5Pset_chunk(made.id(), static_cast<int>(chunk.size()), chunk.data()) >= 0)
    handle = Handle(H5Dcreate2(handle_.id(), name.c_str(), file_type(type), space.id(), H5P_DEFAULT,
                               made.id(), H5P_DEFAULT));
  if (handle.id() < 0)
    fail_write("dataset '" + name + "' cannot be made");
  return {std::move(handle), file_, path_of(name), shape, type};
}

void Group::create_row_view(const std::string& name, const Dataset& of, std::uint64_t row) {
  const std::vector<hsize_t> dims = dims_of(of.shape());
  std::vector<hsize_t> first(dims.size()), count = dims;
  first[0] = row;
  count[0] = 1;
  const Handle from(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr));
  const Handle to(H5Screate_simple(static_cast<int>(dims.size()) - 1, dims.data() + 1, nullptr));
  const Handle made = properties(H5P_DATASET_CREATE);
  Handle handle(-1);
  if (H5Sselect_hyperslab(from.id(), H5S_SELECT_SET, first.data(), nullptr, count.data(),
                          nullptr) >= 0 &&
      H5Pset_virtual(made.id(), to.id(), ".", of.name().c_str(), from.id()) >= 0)
    handle = Handle(H5Dcreate2(handle_.id(), name.c_str(), file_type(of.type()), to.id(),
                               H5P_DEFAULT, made.id(), H5P_DEFAULT));
  if (handle.id() < 0)
    fail_write("dataset '" + name + "' cannot be made");
}

namespace {

/// That an array stands in this file, whole and as it is: its size is no bare claim.
void require_stored(hid_t dataset, std::uint64_t bytes, const Object& where) {
  const Handle made(H5Dget_create_plist(dataset));
  const H5D_layout_t layout = H5Pget_layout(made.id());
  if (H5Pget_nfilters(made.id()) != 0 || H5Pget_external_count(made.id()) != 0 ||
      (layout != H5D_CONTIGUOUS && layout != H5D_CHUNKED && layout != H5D_COMPACT))
    where.fail("is stored in a way that is not expected here");
  const Handle file(H5Iget_file_id(dataset));
  hsize_t size = 0;
  if (H5Fget_filesize(file.id(), &size) < 0 || bytes > size ||
      (bytes > 0 && H5Dget_storage_size(dataset) < bytes))
    where.fail("claims more bytes than the file holds: " + std::to_string(bytes));
  if (layout == H5D_CONTIGUOUS && bytes > 0) {
    const haddr_t offset = H5Dget_offset(dataset);
    if (offset == HADDR_UNDEF || offset > size || bytes > size - offset)
      where.fail("is not in the file");
  }
}

} // namespace

bool Group::holds(const std::string& name, Number type) const {
  const Handle handle(has(name) ? H5Dopen2(handle_.id(), name.c_str(), H5P_DEFAULT) : -1);
  const Handle found(handle.id() < 0 ? -1 : H5Dget_type(handle.id()));
  return found.id() >= 0 && is_type(found.id(), type);
}

Dataset Group::dataset(const std::string& name, Number type) const {
  Handle handle(has(name) ? H5Dopen2(handle_.id(), name.c_str(), H5P_DEFAULT) : -1);
  if (handle.id() < 0)
    fail("no dataset '" + name + "', expected one");
  const Handle found(H5Dget_type(handle.id()));
  const Handle space(H5Dget_space(handle.id()));
  const hid_t id = handle.id();
  const Dataset named({}, file_, path_of(name), {}, type); // for messages
  if (!is_type(found.id(), type))
    named.fail(std::string("has another type, expected ") + type_name(type));
  Shape shape = shape_of(space.id(), named);
  require_stored(id, bytes_of(shape, type, named), named);
  return {std::move(handle), file_, path_of(name), std::move(shape), type};
}

void Group::write_texts(const std::string& name, const std::vector<std::string>& texts) {
  std::size_t longest = 1;
  for (const std::string& text : texts)
    longest = std::max(longest, text.size());
  if (longest > max_text)
    fail("dataset '" + name + "': a text is too long");
  std::string padded(longest * texts.size(), '\0');
  for (std::size_t i = 0; i < texts.size(); ++i)
    texts[i].copy(padded.data() + i * longest, texts[i].size());
  const Handle type = text_type(longest);
  const hsize_t count = texts.size();
  const Handle space(H5Screate_simple(1, &count, nullptr));
  const Handle made = properties(H5P_DATASET_CREATE);
  const Handle handle(H5Dcreate2(handle_.id(), name.c_str(), type.id(), space.id(), H5P_DEFAULT,
                                 made.id(), H5P_DEFAULT));
  if (handle.id() < 0 || (count > 0 && H5Dwrite(handle.id(), type.id(), H5S_ALL, H5S_ALL,
                                                H5P_DEFAULT, padded.data()) < 0))
    fail_write("dataset '" + name + "' cannot be written");
}

std::vector<std::string> Group::read_texts(const std::string& name) const {
  const Handle handle(has(name) ? H5Dopen2(handle_.id(), name.c_str(), H5P_DEFAULT) : -1);
  if (handle.id() < 0)
    fail("no dataset '" + name + "', expected one");
  const Handle type(H5Dget_type(handle.id()));
  const Handle space(H5Dget_space(handle.id()));
  const Dataset named({}, file_, path_of(name), {}, Number::uint8); // for messages
  const std::size_t size = text_size(type.id());
  const Shape shape = shape_of(space.id(), named);
  if (size == 0 || size > max_text || shape.size() != 1)
    named.fail("is no list of texts");
  require_stored(handle.id(), bytes_of({shape[0], size}, Number::uint8, named), named);
  std::string padded(shape[0] * size, '\0');
  if (!padded.empty() &&
      H5Dread(handle.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, padded.data()) < 0)
    named.fail("cannot be read" + system_reason());
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < shape[0]; ++i)
    texts.push_back(until_zero(padded.data() + i * size, size));
  return texts;
}

// ---- File

File::File(Handle handle, std::shared_ptr<FileState> file)
    : file_(std::move(file)), handle_(std::move(handle)) {
  Handle root(H5Gopen2(handle_.id(), "/", H5P_DEFAULT));
  if (root.id() < 0)
    throw Error(file_->path, "is damaged: its outermost group cannot be read");
  root_.reset(new Group(std::move(root), file_, "/"));
}

File File::create(const std::string& path, const std::string& name) {
  silence();
  return create(path, name.empty() ? path : name, access());
}

File File::create_with_checkpoints(const std::string& path) {
  silence();
  Handle how = access();
  if (!use_checkpoints(how.id()))
    throw Error(path, "cannot be made as an HDF5 file");
  return create(path, path, std::move(how));
}

File File::reopen_checkpoint(const std::string& path) {
  silence();
  if (const int error = restore_checkpoint(path); error != 0)
    throw Error(path, std::string("cannot be restored: ") + std::strerror(error));
  const Handle how = access();
  Handle handle(use_checkpoints(how.id()) ? H5Fopen(path.c_str(), H5F_ACC_RDWR, how.id()) : -1);
  if (handle.id() < 0)
    throw Error(path, "holds nothing that was finished" + system_reason());
  return {std::move(handle), std::make_shared<FileState>(FileState{.path = path, .writing = true})};
}

File File::create_by_link(const std::string& link, const std::string& name) {
  silence();
  Handle how = access();
  // Its usual driver resolves a link that leads nowhere.
  if (H5Pset_fapl_stdio(how.id()) < 0)
    throw Error(name, "cannot be made as an HDF5 file");
  return create(link, name, std::move(how));
}

File File::create(const std::string& path, const std::string& called, Handle how) {
  const Handle made = properties(H5P_FILE_CREATE);
  Handle handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, made.id(), how.id()));
  if (handle.id() < 0)
    throw Error(called, "cannot be made as an HDF5 file" + system_reason());
  return {std::move(handle),
          std::make_shared<FileState>(FileState{.path = called, .writing = true})};
}

namespace {

constexpr std::string_view signature("\x89HDF\r\n\x1a\n", 8);
constexpr std::size_t superblock_size = 48;
using Superblock = std::array<unsigned char, superblock_size>;

/// Refuses what is no HDF5 file of this format, and files cut off, before the library sees them.
void check_superblock(const std::string& name, const Superblock& head, std::size_t have,
                      std::uint64_t size) {
  if (have < signature.size() || std::memcmp(head.data(), signature.data(), signature.size()) != 0)
    throw Error(name, "byte 0: no HDF5 file, expected the magic bytes of one");
  if (have < superblock_size)
    throw Error(name, "ends early, after " + std::to_string(size) + " bytes");
  if (head[8] < 2 || head[8] > 3 || head[9] != 8 || head[10] != 8)
    return; // of another program: the library decides
  const std::size_t end_at = 28;
  std::uint64_t end = 0;
  for (std::size_t i = 8; i-- > 0;)
    end = end << 8 | head.at(end_at + i);
  if (size < end)
    throw Error(name, "ends early, after " + std::to_string(size) + " bytes, expected " +
                          std::to_string(end));
}

Error open_error(const std::string& path) {
  return {path, std::string("cannot open: ") + std::strerror(errno)};
}

/// With the system's reason, such as too many open files; without one the file itself is damaged.
[[noreturn]] void fail_open(const std::string& path) {
  const std::string reason = system_reason();
  throw Error(path, reason.empty() || reason == ": Success"
                        ? "is damaged: it cannot be opened as an HDF5 file"
                        : "cannot open" + reason);
}

} // namespace

File File::open(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0)
    throw open_error(path);
  if (S_ISDIR(info.st_mode))
    throw Error(path, "is a directory, expected a file");
  if (!S_ISREG(info.st_mode))
    throw Error(path, "is no regular file, expected one, since HDF5 is not read forwards");
  note_read(path);
  return open_own(path);
}

File File::open_own(const std::string& path) {
  silence();
  const auto close = [](std::FILE* file) { (void)std::fclose(file); };
  const std::unique_ptr<std::FILE, decltype(close)> file(std::fopen(path.c_str(), "rb"), close);
  struct stat info {};
  if (file == nullptr || ::fstat(::fileno(file.get()), &info) != 0)
    throw open_error(path);
  if (info.st_size == 0)
    throw Error(path, "is empty");
  Superblock head{};
  const std::size_t have = std::fread(head.data(), 1, head.size(), file.get());
  check_superblock(path, head, have, static_cast<std::uint64_t>(info.st_size));
  const Handle how = access();
  Handle handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, how.id()));
  if (handle.id() < 0)
    fail_open(path);
  return {std::move(handle), std::make_shared<FileState>(FileState{.path = path})};
}

File File::open_image(std::span<const std::uint8_t> bytes, const std::string& name) {
  silence();
  if (bytes.empty())
    throw Error(name, "is empty");
  Superblock head{};
  const std::size_t have = std::min(bytes.size(), head.size());
  std::copy_n(bytes.begin(), have, head.begin());
  check_superblock(name, head, have, bytes.size());
  const Handle how = access();
  // The library copies the bytes.
  std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
  if (H5Pset_fapl_core(how.id(), 65536, false) < 0 ||
      H5Pset_file_image(how.id(), copy.data(), copy.size()) < 0)
    throw Error(name, "cannot be read from memory");
  Handle handle(H5Fopen(name.c_str(), H5F_ACC_RDONLY, how.id()));
  if (handle.id() < 0)
    fail_open(name);
  return {std::move(handle), std::make_shared<FileState>(FileState{.path = name})};
}

File::~File() {
  if (file_ == nullptr)
    return;
  // What wasn't closed in writing is given up: see FileState.
  if (file_->gone() || file_->writing)
    (void)handle_.release();
  file_->closed = true;
}

void File::checkpoint() {
  if (!file_->failed && H5Fflush(handle_.id(), H5F_SCOPE_LOCAL) >= 0) {
    const int error = make_checkpoint(handle_.id());
    if (error == 0)
      return;
    file_->failed = true;
    throw Error(file_->path, std::string("cannot write: ") + std::strerror(error));
  }
  const std::string reason = file_->failed ? file_->reason : system_reason();
  file_->failed = true;
  throw Error(file_->path, "cannot write" + reason);
}

void File::abandon() noexcept {
  if (file_->closed)
    return;
  discard_writes(handle_.id());
  root_.reset();
  const std::int64_t id = handle_.release();
  if (!file_->failed)
    (void)H5Fclose(id);
  file_->closed = true;
}

void File::close() {
  root_.reset();
  bool good = !file_->failed && H5Fflush(handle_.id(), H5F_SCOPE_LOCAL) >= 0;
  const std::int64_t id = handle_.release();
  good = good && H5Fclose(id) >= 0;
  file_->closed = true;
  if (!good)
    throw Error(file_->path, "cannot write" + (file_->failed ? file_->reason : system_reason()));
}

} // namespace gewebe::formats::hdf5
