#include "base/digest.h"
#include "formats/store/checkpoint_driver_internal.h"

#define H5_USE_110_API // later versions keep its names
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <fcntl.h>
#include <iterator>
#include <map>
#include <memory>
#include <string_view>
#include <sys/stat.h>
#include <unistd.h>
#include <vector>

namespace gewebe::formats::hdf5 {

static_assert(std::endian::native == std::endian::little);

namespace {

constexpr std::uint64_t page_size = 512;
constexpr std::uint64_t step = 65536;     // in which the file grows
constexpr std::uint64_t reserved = 24576; // for an attribute, and its log
constexpr std::uint64_t log_magic = 0x474f4c4257455747;
constexpr std::string_view signature("\x89HDF\r\n\x1a\n", 8); // of an HDF5 file
constexpr std::size_t superblock_size = 48;                   // of version 2 or 3
constexpr std::size_t end_at = 28;                            // in it: the file's size

using Bytes = std::vector<unsigned char>;

/// What stands behind the pages of a log, at the end of the file.
struct LogEnd {
  std::uint64_t magic = log_magic;
  std::uint64_t start = 0; ///< of the log in the file
  std::uint64_t size = 0;  ///< of its pages, each with a head
  std::uint64_t end = 0;   ///< of the file without it
  std::uint64_t digest = 0;
};
struct LogPage {
  std::uint64_t address = 0, size = 0;
};

std::uint64_t digest_of(const LogEnd& log, const unsigned char* pages) {
  Digest digest;
  digest.add(log.start);
  digest.add(log.size);
  digest.add(log.end);
  digest.add_bytes(pages, log.size);
  return digest.value();
}

/// errno, or 0.
int write_at(int fd, std::uint64_t at, const unsigned char* from, std::size_t size) {
  while (size > 0) {
    const ssize_t count = ::pwrite(fd, from, size, static_cast<off_t>(at));
    if (count < 0 && errno == EINTR)
      continue;
    if (count < 0)
      return errno;
    from += count;
    at += static_cast<std::uint64_t>(count);
    size -= static_cast<std::size_t>(count);
  }
  return 0;
}

/// Zeros behind the end of the file. errno, or 0.
int read_at(int fd, std::uint64_t at, unsigned char* to, std::size_t size) {
  while (size > 0) {
    const ssize_t count = ::pread(fd, to, size, static_cast<off_t>(at));
    if (count < 0 && errno == EINTR)
      continue;
    if (count < 0)
      return errno;
    if (count == 0) {
      std::memset(to, 0, size);
      return 0;
    }
    to += count;
    at += static_cast<std::uint64_t>(count);
    size -= static_cast<std::size_t>(count);
  }
  return 0;
}

/// Blocks of the disk for these bytes, where its file system can say so. errno, or 0.
int allocate(int fd, std::uint64_t from, std::uint64_t to) {
  while (to > from &&
         ::fallocate(fd, 0, static_cast<off_t>(from), static_cast<off_t>(to - from)) != 0)
    if (errno == ENOSPC || errno == EDQUOT || errno == EFBIG)
      return errno;
    else if (errno != EINTR)
      return 0;
  return 0;
}

int cut_off(int fd, std::uint64_t size) {
  return ::ftruncate(fd, static_cast<off_t>(size)) == 0 ? 0 : errno;
}

std::uint64_t size_of_file(int fd) {
  struct stat info {};
  return ::fstat(fd, &info) == 0 ? static_cast<std::uint64_t>(info.st_size) : 0;
}

/// lookup3 by Bob Jenkins (public domain, burtleburtle.net/bob/c/lookup3.c), hashlittle() with the
/// initial value 0: the checksum of a superblock.
std::uint32_t checksum(const unsigned char* bytes, std::size_t size) {
  const auto rotated = [](std::uint32_t x, int by) { return std::rotl(x, by); };
  const auto word = [](const unsigned char* from, std::size_t count) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < count; ++i)
      value |= static_cast<std::uint32_t>(from[i]) << (8 * i);
    return value;
  };
  std::uint32_t a = 0xdeadbeefU + static_cast<std::uint32_t>(size), b = a, c = a;
  for (; size > 12; size -= 12, bytes += 12) {
    a += word(bytes, 4);
    b += word(bytes + 4, 4);
    c += word(bytes + 8, 4);
    a = (a - c) ^ rotated(c, 4);
    c += b;
    b = (b - a) ^ rotated(a, 6);
    a += c;
    c = (c - b) ^ rotated(b, 8);
    b += a;
    a = (a - c) ^ rotated(c, 16);
    c += b;
    b = (b - a) ^ rotated(a, 19);
    a += c;
    c = (c - b) ^ rotated(b, 4);
    b += a;
  }
  if (size == 0)
    return c;
  a += word(bytes, std::min<std::size_t>(size, 4));
  if (size > 4)
    b += word(bytes + 4, std::min<std::size_t>(size - 4, 4));
  if (size > 8)
    c += word(bytes + 8, size - 8);
  c = (c ^ b) - rotated(b, 14);
  a = (a ^ c) - rotated(c, 11);
  b = (b ^ a) - rotated(a, 25);
  c = (c ^ b) - rotated(b, 16);
  a = (a ^ c) - rotated(c, 4);
  b = (b ^ a) - rotated(a, 14);
  return (c ^ b) - rotated(b, 24);
}

bool is_superblock(const unsigned char* bytes, std::size_t size) {
  return size >= superblock_size && std::memcmp(bytes, signature.data(), signature.size()) == 0 &&
         (bytes[8] == 2 || bytes[8] == 3);
}

/// This superblock has no mark of an open file.
void mark_closed(unsigned char* superblock) {
  constexpr std::size_t flags_at = 11, sum_at = superblock_size - 4;
  superblock[flags_at] = 0;
  const std::uint32_t sum = checksum(superblock, sum_at);
  std::memcpy(superblock + sum_at, &sum, sizeof sum);
}

/// Address ranges, each from its key to its value; none touches another.
class Ranges {
public:
  bool contains(std::uint64_t from, std::uint64_t to) const {
    auto next = ranges_.upper_bound(from);
    return next != ranges_.begin() && (--next)->second >= to;
  }
  void add(std::uint64_t from, std::uint64_t to) {
    auto next = ranges_.upper_bound(from);
    if (next != ranges_.begin() && std::prev(next)->second >= from)
      from = (--next)->first;
    while (next != ranges_.end() && next->first <= to) {
      to = std::max(to, next->second);
      next = ranges_.erase(next);
    }
    ranges_[from] = to;
  }
  void remove(std::uint64_t from, std::uint64_t to) {
    auto next = ranges_.upper_bound(from);
    if (next != ranges_.begin())
      --next;
    while (next != ranges_.end() && next->first < to) {
      const auto [first, last] = *next;
      next = ranges_.erase(next);
      if (last <= from || first >= to) {
        next = std::next(ranges_.emplace(first, last).first);
        continue;
      }
      if (first < from)
        ranges_.emplace(first, from);
      if (last > to)
        ranges_.emplace(to, last);
    }
  }

private:
  std::map<std::uint64_t, std::uint64_t> ranges_;
};

/// An open file, as HDF5 and this driver know it.
struct Driver : H5FD_t {
  int fd = -1;
  dev_t device = 0;
  ino_t inode = 0;
  haddr_t eoa = 0, eof = 0;               ///< what HDF5 has allocated, and where its bytes end
  std::uint64_t committed = 0;            ///< size at the last checkpoint
  std::uint64_t length = 0;               ///< of the file on the disk, as of the last log
  std::map<std::uint64_t, Bytes> changed; ///< pages, by address, below held()
  Ranges raw;                             ///< bytes of arrays at the last checkpoint
  struct Use {
    bool raw = false;
    std::uint64_t from = 0, to = 0;
  };
  std::vector<Use> uses;   ///< of other bytes since
  bool reopened = false;   ///< for an attribute
  bool written = false;    ///< since the last checkpoint
  bool discarding = false; ///< what is written
  /// errno of the first write that failed. HDF5 1.10 crashes where writes fail as it closes, so it
  /// is reported at the next checkpoint.
  int failure = 0;

  /// Below this, changes wait for the checkpoint. Before the first one the superblock alone,
  /// without which the file is none.
  std::uint64_t held() const { return std::max(committed, page_size); }
  int read(haddr_t at, std::size_t size, unsigned char* to) const;
  int write(bool is_raw, haddr_t at, std::size_t size, const unsigned char* from);
  int give_up(int error);
  int change(haddr_t at, std::size_t size, const unsigned char* from);
  int make_room(std::uint64_t start, std::uint64_t size);
  int write_log(std::uint64_t start, std::uint64_t end);
  int checkpoint();
};

int Driver::read(haddr_t at, std::size_t size, unsigned char* to) const {
  if (const int error = read_at(fd, at, to, size); error != 0)
    return error;
  for (auto page = changed.lower_bound(at / page_size * page_size);
       page != changed.end() && page->first < at + size; ++page) {
    const std::uint64_t from = std::max<std::uint64_t>(at, page->first);
    const std::uint64_t end = std::min<std::uint64_t>(at + size, page->first + page->second.size());
    if (from < end)
      std::memcpy(to + (from - at), page->second.data() + (from - page->first), end - from);
  }
  return 0;
}

/// \pre at + size <= held()
int Driver::change(haddr_t at, std::size_t size, const unsigned char* from) {
  while (size > 0) {
    const std::uint64_t start = at / page_size * page_size, offset = at - start;
    Bytes& page = changed[start];
    if (page.empty()) {
      page.resize(std::min(page_size, held() - start));
      if (const int error = read_at(fd, start, page.data(), page.size()); error != 0)
        return error;
    }
    const std::size_t count = std::min<std::uint64_t>(size, page.size() - offset);
    std::memcpy(page.data() + offset, from, count);
    at += count;
    from += count;
    size -= count;
  }
  return 0;
}

int Driver::write(bool is_raw, haddr_t at, std::size_t size, const unsigned char* from) {
  if (discarding)
    return 0;
  written = true;
  eof = std::max<haddr_t>(eof, at + size);
  // Rows that are appended to an array stand in chunks of its own, where the last checkpoint has
  // no rows; so they may be written at once.
  const bool appends = is_raw && raw.contains(at, at + size);
  if (!appends)
    uses.push_back({is_raw, at, at + size});
  if (!is_raw)
    raw.remove(at, at + size);
  std::size_t kept = 0; // in memory
  if (!appends && at < held()) {
    kept = std::min<std::uint64_t>(size, held() - at);
    if (const int error = change(at, kept, from); error != 0)
      return give_up(error);
  }
  return kept == size ? 0 : give_up(write_at(fd, at + kept, from + kept, size - kept));
}

/// Where there is an error, the file goes back to its last checkpoint and stays so.
int Driver::give_up(int error) {
  if (error != 0) {
    discarding = true;
    (void)cut_off(fd, committed);
  }
  return error;
}

/// Room for `size` bytes behind the bytes of this checkpoint and of the last one, and for what
/// marks a partial result on a full disk. The file is grown in steps, since that takes as long as
/// many writes.
int Driver::make_room(std::uint64_t start, std::uint64_t size) {
  struct stat info {};
  if (::fstat(fd, &info) != 0)
    return errno;
  const std::uint64_t wanted = start + size, more = reopened ? 0 : reserved;
  if (wanted + more <= length && static_cast<std::uint64_t>(info.st_size) == length)
    return 0; // as it was grown
  std::uint64_t longer = (wanted + more + step) / step * step + step;
  if (allocate(fd, committed, longer) != 0) {
    longer = (wanted + more + page_size) / page_size * page_size;
    if (const int error = allocate(fd, committed, longer); error != 0)
      return error;
  }
  length = longer;
  return ::ftruncate(fd, static_cast<off_t>(longer)) == 0 ? 0 : errno; // where it can't allocate
}

int Driver::write_log(std::uint64_t start, std::uint64_t end) {
  Bytes log;
  for (const auto& [address, bytes] : changed) {
    const LogPage head{address, bytes.size()};
    const auto* const head_bytes = reinterpret_cast<const unsigned char*>(&head);
    log.insert(log.end(), head_bytes, head_bytes + sizeof head);
    log.insert(log.end(), bytes.begin(), bytes.end());
  }
  LogEnd last;
  last.start = start;
  last.size = log.size();
  last.end = end;
  last.digest = digest_of(last, log.data());
  if (const int error = make_room(start, log.size() + sizeof last); error != 0)
    return error;
  if (const int error = write_at(fd, start, log.data(), log.size()); error != 0)
    return error;
  return write_at(fd, length - sizeof last, reinterpret_cast<const unsigned char*>(&last),
                  sizeof last);
}

int Driver::checkpoint() {
  if (failure != 0)
    return give_up(failure);
  if (discarding || !written)
    return 0;
  const std::uint64_t start = std::max<std::uint64_t>(committed, eoa);
  const std::uint64_t end = changed.empty() ? start : eoa;
  if (const int error = write_log(start, end); error != 0)
    return give_up(error);
  for (const auto& [address, bytes] : changed)
    if (const int error = write_at(fd, address, bytes.data(), bytes.size()); error != 0) {
      discarding = true; // the log stays
      return error;
    }
  const LogEnd none{0, 0, 0, 0, 0};
  if (const int error = write_at(fd, length - sizeof none,
                                 reinterpret_cast<const unsigned char*>(&none), sizeof none);
      error != 0)
    return error;
  committed = end;
  written = false;
  changed.clear();
  for (const Use& use : uses)
    if (use.raw)
      raw.add(use.from, use.to);
    else
      raw.remove(use.from, use.to);
  uses.clear();
  return 0;
}

herr_t report(int error) {
  if (error == 0)
    return 0;
  (void)H5Epush2(H5E_DEFAULT, __FILE__, "checkpoint_driver", __LINE__, H5E_ERR_CLS, H5E_IO,
                 H5E_WRITEERROR, "error message = '%s'", std::strerror(error));
  return -1;
}

Driver& driver(H5FD_t* file) {
  return *static_cast<Driver*>(file);
}
const Driver& driver(const H5FD_t* file) {
  return *static_cast<const Driver*>(file);
}

extern "C" {

static H5FD_t* driver_open(const char* name, unsigned flags, hid_t /*access*/,
                           haddr_t /*longest*/) noexcept {
  try {
    auto made = std::make_unique<Driver>();
    int how = (flags & H5F_ACC_RDWR) != 0 ? O_RDWR : O_RDONLY;
    how |= (flags & H5F_ACC_TRUNC) != 0 ? O_TRUNC : 0;
    how |= (flags & H5F_ACC_CREAT) != 0 ? O_CREAT : 0;
    how |= (flags & H5F_ACC_EXCL) != 0 ? O_EXCL : 0;
    made->fd = ::open(name, how | O_CLOEXEC, 0666);
    struct stat info {};
    if (made->fd < 0 || ::fstat(made->fd, &info) != 0) {
      (void)report(errno);
      if (made->fd >= 0)
        (void)::close(made->fd);
      return nullptr;
    }
    made->reopened = (flags & H5F_ACC_CREAT) == 0;
    made->device = info.st_dev;
    made->inode = info.st_ino;
    made->eof = made->committed = static_cast<std::uint64_t>(info.st_size);
    return made.release();
  } catch (...) {
    return nullptr;
  }
}

static herr_t driver_close(H5FD_t* file) noexcept {
  const std::unique_ptr<Driver> closed(&driver(file));
  int error = 0;
  try {
    error = closed->checkpoint();
  } catch (...) {
    error = ENOMEM;
  }
  if (error == 0 && !closed->discarding && closed->length > 0)
    error = cut_off(closed->fd, closed->committed); // without what was reserved
  return ::close(closed->fd) == 0 ? report(error) : report(errno);
}

static int driver_compare(const H5FD_t* one, const H5FD_t* other) noexcept {
  const Driver &a = driver(one), &b = driver(other);
  if (a.discarding || b.discarding) // what HDF5 knows of it is no longer so
    return &a == &b ? 0 : &a < &b ? -1 : 1;
  if (a.device != b.device)
    return a.device < b.device ? -1 : 1;
  return a.inode == b.inode ? 0 : a.inode < b.inode ? -1 : 1;
}

static herr_t driver_query(const H5FD_t* /*file*/, unsigned long* flags) noexcept {
  if (flags != nullptr)
    *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_DATA_SIEVE | H5FD_FEAT_AGGREGATE_SMALLDATA |
             H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
  return 0;
}

static haddr_t driver_get_eoa(const H5FD_t* file, H5FD_mem_t /*type*/) noexcept {
  return driver(file).eoa;
}

static herr_t driver_set_eoa(H5FD_t* file, H5FD_mem_t /*type*/, haddr_t address) noexcept {
  driver(file).eoa = address;
  return 0;
}

static haddr_t driver_get_eof(const H5FD_t* file, H5FD_mem_t /*type*/) noexcept {
  return driver(file).eof;
}

static herr_t driver_get_handle(H5FD_t* file, hid_t /*access*/, void** handle) noexcept {
  *handle = &driver(file);
  return 0;
}

static herr_t driver_read(H5FD_t* file, H5FD_mem_t /*type*/, hid_t /*how*/, haddr_t at,
                          std::size_t size, void* to) noexcept {
  return report(driver(file).read(at, size, static_cast<unsigned char*>(to)));
}

static herr_t driver_write(H5FD_t* file, H5FD_mem_t type, hid_t /*how*/, haddr_t at,
                           std::size_t size, const void* from) noexcept {
  try {
    Driver& to = driver(file);
    const auto* const bytes = static_cast<const unsigned char*>(from);
    int error = 0;
    if (at != 0 || !is_superblock(bytes, size)) {
      error = to.write(type == H5FD_MEM_DRAW, at, size, bytes);
    } else {
      Bytes closed(bytes, bytes + size);
      mark_closed(closed.data());
      error = to.write(false, at, size, closed.data());
    }
    to.failure = to.failure == 0 ? error : to.failure;
    return 0;
  } catch (...) {
    return report(ENOMEM);
  }
}

static herr_t driver_truncate(H5FD_t* file, hid_t /*how*/, hbool_t /*closing*/) noexcept {
  driver(file).eof = driver(file).eoa; // on the disk at the next checkpoint
  return 0;
}

} // extern "C"

H5FD_class_t class_of_driver() {
  H5FD_class_t made{};
  made.name = "gewebe_checkpoints";
  made.maxaddr = HADDR_MAX / 2;
  made.fc_degree = H5F_CLOSE_STRONG;
  made.open = driver_open;
  made.close = driver_close;
  made.cmp = driver_compare;
  made.query = driver_query;
  made.get_eoa = driver_get_eoa;
  made.set_eoa = driver_set_eoa;
  made.get_eof = driver_get_eof;
  made.get_handle = driver_get_handle;
  made.read = driver_read;
  made.write = driver_write;
  made.truncate = driver_truncate;
  constexpr std::array<H5FD_mem_t, H5FD_MEM_NTYPES> lists H5FD_FLMAP_DICHOTOMY;
  std::copy(lists.begin(), lists.end(), std::begin(made.fl_map));
  return made;
}

Driver* driver_of(std::int64_t file) {
  void* handle = nullptr;
  return H5Fget_vfd_handle(file, H5P_DEFAULT, &handle) < 0 ? nullptr : static_cast<Driver*>(handle);
}

} // namespace

bool use_checkpoints(std::int64_t access) {
  static const H5FD_class_t driver_class = class_of_driver();
  static const hid_t number = H5FDregister(&driver_class);
  return number >= 0 && H5Pset_driver(access, number, nullptr) >= 0;
}

int make_checkpoint(std::int64_t file) {
  Driver* const of = driver_of(file);
  return of == nullptr ? EINVAL : of->checkpoint();
}

void discard_writes(std::int64_t file) {
  if (Driver* const of = driver_of(file); of != nullptr) {
    (void)cut_off(of->fd, of->committed);
    of->discarding = true;
  }
}

namespace {

/// Carries out the log behind the file's end, if a whole one is there. errno, or 0.
int redo(int fd) {
  const std::uint64_t size = size_of_file(fd);
  LogEnd last;
  if (size < sizeof last)
    return 0;
  if (const int error =
          read_at(fd, size - sizeof last, reinterpret_cast<unsigned char*>(&last), sizeof last);
      error != 0)
    return error;
  if (last.magic != log_magic || last.end > last.start || last.start > size - sizeof last ||
      last.size > size - sizeof last - last.start)
    return 0;
  Bytes log(last.size);
  if (const int error = read_at(fd, last.start, log.data(), log.size()); error != 0)
    return error;
  if (digest_of(last, log.data()) != last.digest)
    return 0;
  for (std::size_t at = 0; at + sizeof(LogPage) <= log.size();) {
    LogPage page;
    std::memcpy(&page, log.data() + at, sizeof page);
    at += sizeof page;
    if (page.size > log.size() - at)
      return EINVAL;
    if (const int error = write_at(fd, page.address, log.data() + at, page.size); error != 0)
      return error;
    at += page.size;
  }
  return cut_off(fd, last.end);
}

} // namespace

int restore_checkpoint(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC);
  if (fd < 0)
    return errno;
  int error = redo(fd);
  std::array<unsigned char, superblock_size> head{};
  if (error == 0)
    error = read_at(fd, 0, head.data(), head.size());
  if (error == 0 && is_superblock(head.data(), head.size())) {
    std::uint64_t end = 0; // what stands behind it is of a checkpoint that did not come
    std::memcpy(&end, head.data() + end_at, sizeof end);
    if (end < size_of_file(fd))
      error = cut_off(fd, end);
  }
  (void)::close(fd);
  return error;
}

} // namespace gewebe::formats::hdf5
