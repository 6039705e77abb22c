#pragma once
// HDF5 files through the library's C interface: numbers, texts, arrays, and nothing that a damaged
// file could misuse. Files carry no time, and their format is fixed (that of HDF5 1.10, in which
// every piece of metadata has a checksum), so equal content makes equal bytes.
//
// Every failure is an Error whose place is the path. Not to be used from several threads at once.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace gewebe::formats::hdf5 {

enum class Number : std::uint8_t { float64, float32, int64, uint64, int32, uint32, uint8 };

template <class T>
constexpr Number number_of() {
  using V = std::remove_const_t<T>;
  if constexpr (std::is_same_v<V, double>)
    return Number::float64;
  else if constexpr (std::is_same_v<V, float>)
    return Number::float32;
  else if constexpr (std::is_same_v<V, std::int64_t>)
    return Number::int64;
  else if constexpr (std::is_same_v<V, std::uint64_t>)
    return Number::uint64;
  else if constexpr (std::is_same_v<V, std::int32_t>)
    return Number::int32;
  else if constexpr (std::is_same_v<V, std::uint32_t>)
    return Number::uint32;
  else {
    static_assert(std::is_same_v<V, std::uint8_t>, "no number that files hold");
    return Number::uint8;
  }
}

std::size_t size_of(Number type) noexcept;

/// Of an array, slowest index first; empty for a single number.
using Shape = std::vector<std::uint64_t>;

/// A name that HDF5 takes for one link: '/' becomes '_', as does a name of dots alone or an empty
/// one.
std::string link_name(std::string_view name);

/// A reference to something the library counts.
class Handle {
public:
  Handle() = default;
  explicit Handle(std::int64_t id) : id_(id) {}
  ~Handle();
  Handle(Handle&& other) noexcept : id_(other.id_) { other.id_ = -1; }
  Handle& operator=(Handle&& other) noexcept;
  std::int64_t id() const noexcept { return id_; }
  std::int64_t release() noexcept { return std::exchange(id_, -1); }

private:
  std::int64_t id_ = -1;
};

/// What everything in a file knows of it. After a write has failed (a full disk) the library can
/// neither write nor forget what it holds, and crashes when it tries: handles of such a file are
/// left alone.
struct FileState {
  std::string path{};
  bool writing = false;
  bool failed = false;  ///< a write has
  bool closed = false;  ///< and everything in it
  std::string reason{}; ///< of the failure, as far as it was seen late

  bool gone() const noexcept { return failed || closed; }
};

/// What groups and datasets share: attributes. Those read must be of the requested type and small.
class Object {
public:
  ~Object();
  Object(Object&&) noexcept = default;
  /// What it was before goes with `other`, and ends with it.
  Object& operator=(Object&& other) noexcept {
    handle_ = std::move(other.handle_);
    file_.swap(other.file_);
    name_.swap(other.name_);
    return *this;
  }
  /// How messages name it: "/uterus/factor".
  const std::string& name() const noexcept { return name_; }
  /// \throw Error, place = path of the file, text "'NAME': what"
  [[noreturn]] void fail(const std::string& what) const;

  bool has_attribute(const std::string& name) const;
  void set(const std::string& name, std::string_view text);
  void set(const std::string& name, const char* text) { set(name, std::string_view(text)); }
  template <class T>
    requires std::is_arithmetic_v<T>
  void set(const std::string& name, T value) {
    set_numbers(name, number_of<T>(), &value, nullptr);
  }
  /// Another value of an attribute that is there.
  template <class T>
    requires std::is_arithmetic_v<T>
  void replace(const std::string& name, T value) {
    replace_number(name, number_of<T>(), &value);
  }
  template <class T>
  void set(const std::string& name, std::span<const T> values) {
    const std::uint64_t count = values.size();
    set_numbers(name, number_of<T>(), values.data(), &count);
  }

  std::string text(const std::string& name) const;
  template <class T>
  T number(const std::string& name) const {
    T value{};
    get_numbers(name, number_of<T>(), &value, 1);
    return value;
  }
  /// \throw Error too if there are more or fewer than `count`
  template <class T>
  std::vector<T> numbers(const std::string& name, std::size_t count) const {
    std::vector<T> values(count);
    get_numbers(name, number_of<T>(), values.data(), count);
    return values;
  }

protected:
  Object(Handle handle, std::shared_ptr<FileState> file, std::string name)
      : handle_(std::move(handle)), file_(std::move(file)), name_(std::move(name)) {}
  void set_numbers(const std::string& name, Number type, const void* values,
                   const std::uint64_t* count);
  void replace_number(const std::string& name, Number type, const void* value);
  void get_numbers(const std::string& name, Number type, void* values, std::size_t count) const;

  /// The same of a write, with what the system said.
  [[noreturn]] void fail_write(const std::string& what) const;

  Handle handle_;
  std::shared_ptr<FileState> file_;
  std::string name_;
};

/// An array. Rows are its entries along the first index.
class Dataset : public Object {
public:
  const Shape& shape() const noexcept { return shape_; }
  Number type() const noexcept { return type_; }
  std::uint64_t rows() const noexcept { return shape_.empty() ? 1 : shape_[0]; }
  /// \throw Error naming both if it has another shape
  void require_shape(const Shape& shape) const;
  /// Numbers in a row.
  std::uint64_t row_size() const noexcept { return row_size_; }

  /// Where its bytes stand in the file, contiguous as create_dataset makes it.
  std::uint64_t offset() const;
  /// \pre values.size() is a multiple of row_size(), type() is that of T
  /// \throw Error too if the rows are not there
  template <class T>
  void write_rows(std::uint64_t first, std::span<const T> values) {
    transfer_write(number_of<T>(), first, values.data(), values.size());
  }
  template <class T>
  void read_rows(std::uint64_t first, std::span<T> values) const {
    transfer_read(number_of<T>(), first, values.data(), values.size());
  }
  /// Adds rows at the end of a growing dataset.
  template <class T>
  void append(std::span<const T> values) {
    const std::uint64_t first = rows();
    grow(values.size());
    write_rows(first, values);
  }

private:
  friend class Group;
  Dataset(Handle handle, std::shared_ptr<FileState> file, std::string name, Shape shape,
          Number type);
  void grow(std::size_t values);
  std::pair<Handle, Handle> select(std::uint64_t first, std::size_t values, Number type) const;
  void transfer_write(Number type, std::uint64_t first, const void* values, std::size_t count);
  void transfer_read(Number type, std::uint64_t first, void* values, std::size_t count) const;

  Shape shape_;
  std::uint64_t row_size_ = 1;
  Number type_;
};

class Group : public Object {
public:
  /// Whether there is a group or dataset of this name (a link to elsewhere is none).
  bool has(const std::string& name) const;
  /// Names of the groups in it, in order of the alphabet.
  std::vector<std::string> groups() const;
  Group group(const std::string& name) const;
  Group create_group(const std::string& name);

  /// Contiguous, with its space allocated at once and holding zeros until written, so that it can
  /// be written in place.
  Dataset create_dataset(const std::string& name, Number type, const Shape& shape);
  /// Of 0 rows; `row_shape` is the shape of one row, `rows_per_chunk` how many are kept together.
  Dataset create_growing(const std::string& name, Number type, const Shape& row_shape,
                         std::uint64_t rows_per_chunk = 1);
  /// Row `row` of `of`, a dataset of this file, under a name of its own (a virtual dataset, which
  /// holds no bytes of its own), for readers that can't take a part of a dataset.
  /// \pre row < of.rows()
  void create_row_view(const std::string& name, const Dataset& of, std::uint64_t row);
  /// Whether there is a dataset of this name and type.
  bool holds(const std::string& name, Number type) const;
  /// \throw Error too if it isn't of `type`, or its size exceeds what the file holds: every number
  /// of it stands in the file
  Dataset dataset(const std::string& name, Number type) const;

  template <class T>
  Dataset write(const std::string& name, std::span<const T> values, const Shape& shape) {
    Dataset made = create_dataset(name, number_of<T>(), shape);
    made.write_rows(0, values);
    return made;
  }
  template <class T>
  Dataset write(const std::string& name, const std::vector<T>& values) {
    return write(name, std::span<const T>(values), {values.size()});
  }
  /// A list of numbers. \throw Error too if it has another shape than a list of `count`
  template <class T>
  std::vector<T> read(const std::string& name, std::uint64_t count) const {
    const Dataset from = dataset(name, number_of<T>());
    from.require_shape({count});
    std::vector<T> values(count);
    from.read_rows(0, std::span<T>(values));
    return values;
  }
  /// A list of texts, and back.
  void write_texts(const std::string& name, const std::vector<std::string>& texts);
  std::vector<std::string> read_texts(const std::string& name) const;

private:
  friend class File;
  using Object::Object;
  std::string path_of(const std::string& name) const;
};

class File {
public:
  /// Empties or makes it. `name` is what messages call it, the path itself if empty.
  static File create(const std::string& path, const std::string& name = "");
  /// The same with a driver that keeps the state of the last `checkpoint`, whatever ends the
  /// program or fails.
  static File create_with_checkpoints(const std::string& path);
  /// Opens such a file as its last checkpoint left it, for changes. \throw Error too if there was
  /// none
  static File reopen_checkpoint(const std::string& path);
  /// The same for a file without a name, by a link of /proc to it.
  static File create_by_link(const std::string& link, const std::string& name);
  /// For reading. \throw Error too if it is missing, a folder, empty, no HDF5 or cut off
  static File open(const std::string& path);
  /// The same for a file that this program has made and closed.
  static File open_own(const std::string& path);
  /// A file that stands in memory; `name` is what messages call it.
  static File open_image(std::span<const std::uint8_t> bytes, const std::string& name);

  ~File();
  File(File&&) noexcept = default;
  File& operator=(File&&) noexcept = default;

  /// The outermost group.
  Group& root() noexcept { return *root_; }
  const Group& root() const noexcept { return *root_; }
  const std::string& path() const noexcept { return file_->path; }
  /// Writes what is still in memory, and closes everything in it: no group or dataset may be used
  /// afterwards. Without it what is lost is lost in silence. \throw Error
  void close();
  /// What was written so far stays, whatever comes. \pre made with checkpoints
  /// \throw Error; the file is as the last checkpoint left it
  void checkpoint();
  /// Closes it as the last checkpoint left it. \pre made with checkpoints
  void abandon() noexcept;

private:
  File(Handle handle, std::shared_ptr<FileState> file);
  static File create(const std::string& path, const std::string& called, Handle how);

  std::shared_ptr<FileState> file_;
  Handle handle_;
  std::unique_ptr<Group> root_;
};

} // namespace gewebe::formats::hdf5
