#include "formats/results/shared_shapes.h"

#include "base/error.h"
#include "formats/stream/removal.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace gewebe::formats {

namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t line = 64; // of the cache: what starts at its multiples shares none
constexpr std::size_t page = 4096;

constexpr std::size_t rounded_up(std::size_t bytes, std::size_t to) {
  return (bytes + to - 1) / to * to;
}

[[noreturn]] void fail(const std::string& path, const char* what, int error) {
  throw Error(path, std::string(what) + ": " + std::strerror(error));
}

/// Removes what a killed run has left. \throw Error if it is anything else
void remove_stale(const std::string& path) {
  struct stat info {};
  if (::lstat(path.c_str(), &info) != 0)
    return; // creating it reports what is wrong
  const char* const foreign = "is there and no run has left it, expected another name";
  if (!S_ISREG(info.st_mode) || info.st_uid != ::geteuid())
    throw Error(path, foreign);
  const Descriptor old(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK));
  std::uint64_t magic = 0;
  if (!old || ::pread(old.get(), &magic, sizeof magic, 0) != sizeof magic || magic != shared_magic)
    throw Error(path, foreign);
  if (::flock(old.get(), LOCK_EX | LOCK_NB) != 0)
    throw Error(path, "another run has its shapes there, expected another name");
  if (::unlink(path.c_str()) != 0 && errno != ENOENT)
    fail(path, "a run that is gone has left it, but it cannot be removed", errno);
}

} // namespace

SharedShapes::SharedShapes(const std::string& path) : path_(path) {
  const Descriptor lock = lock_folder_of(path);
  remove_stale(path);
  {
    const SignalsWait wait;
    file_ =
        Descriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
    if (!file_)
      fail(path, "cannot make it", errno);
    removal_ = remember_removal(path);
  }
  try {
    make();
  } catch (const Error&) {
    (void)::unlink(path.c_str());
    forget_removal(removal_);
    throw;
  }
}

void SharedShapes::make() {
  struct stat info {};
  if (::flock(file_.get(), LOCK_EX | LOCK_NB) != 0 || ::fstat(file_.get(), &info) != 0)
    fail(path_, "cannot take it for this run", errno);
  device_ = info.st_dev;
  inode_ = info.st_ino;
  grow(page);
  std::memcpy(memory_, &head_, sizeof head_);
}

SharedShapes::~SharedShapes() {
  if (memory_ != nullptr)
    (void)::munmap(memory_, bytes_);
  forget_removal(removal_);
  struct stat info {}; // what another has put there stays
  if (::lstat(path_.c_str(), &info) == 0 && info.st_dev == device_ && info.st_ino == inode_)
    (void)::unlink(path_.c_str());
}

/// Its blocks are taken now, for a store to one that the disk does not have would end the program.
void SharedShapes::grow(std::size_t bytes) {
  int error = EINTR;
  while (error == EINTR)
    error = ::posix_fallocate(file_.get(), static_cast<off_t>(bytes_),
                              static_cast<off_t>(bytes - bytes_));
  if (error != 0)
    fail(path_, "cannot get larger", error);
  void* const moved = memory_ == nullptr ? ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                                                  MAP_SHARED, file_.get(), 0)
                                         : ::mremap(memory_, bytes_, bytes, MREMAP_MAYMOVE);
  if (moved == MAP_FAILED)
    fail(path_, "cannot be mapped", errno);
  memory_ = static_cast<unsigned char*>(moved);
  bytes_ = bytes;
}

/// Each store is a release, so that no reader sees it without `begun`, which came before.
void SharedShapes::put(std::size_t offset, std::uint64_t value) noexcept {
  std::atomic_ref<std::uint64_t>(*reinterpret_cast<std::uint64_t*>(memory_ + offset))
      .store(value, std::memory_order_release);
}

/// Filled up with zero bytes to whole numbers.
void SharedShapes::put_name(std::size_t offset, std::string_view name) noexcept {
  for (; !name.empty(); offset += 8) {
    const std::size_t count = std::min<std::size_t>(name.size(), 8);
    std::uint64_t word = 0;
    std::memcpy(&word, name.data(), count);
    put(offset, word);
    name.remove_prefix(count);
  }
}

/// \return the offset of a frame of that number and so many bytes
std::size_t SharedShapes::room(std::uint64_t sequence, std::size_t bytes) {
  const bool odd = sequence % 2 == 1;
  SharedPlace& place = odd ? head_.odd : head_.even;
  if (bytes > place.bytes) {
    const std::size_t offset = bytes_, more = rounded_up(bytes + bytes / 2, page);
    grow(offset + more);
    place = {offset, more};
    const std::size_t at = odd ? offsetof(SharedHead, odd) : offsetof(SharedHead, even);
    put(at, place.offset);
    put(at + 8, place.bytes);
  }
  return place.offset;
}

void SharedShapes::note_layout(std::span<const SharedShape> objects, bool changed) {
  const auto same = [](const SharedShape& a, const std::pair<std::string, std::size_t>& b) {
    return a.name == b.first && a.positions.size() == b.second;
  };
  if (generation_ > 0 && !changed &&
      std::equal(objects.begin(), objects.end(), layout_.begin(), layout_.end(), same))
    return;
  ++generation_;
  layout_.clear();
  for (const SharedShape& object : objects)
    layout_.emplace_back(object.name, object.positions.size());
}

void SharedShapes::write(std::uint64_t step, double time, std::span<const SharedShape> objects,
                         bool changed) {
  note_layout(objects, changed);
  std::size_t names = sizeof(SharedFrame) + objects.size() * sizeof(SharedObject);
  std::size_t positions = names;
  for (const SharedShape& object : objects)
    positions += rounded_up(object.name.size(), 8);
  std::size_t bytes = positions = rounded_up(positions, line);
  for (const SharedShape& object : objects)
    bytes += rounded_up(8 * object.positions.size(), line);

  SharedFrame frame;
  frame.sequence = head_.sequence + 1;
  frame.step = step;
  frame.time = time;
  frame.generation = generation_;
  frame.objects = objects.size();
  frame.bytes = bytes;
  put(offsetof(SharedHead, begun), frame.sequence);
  const std::size_t start = room(frame.sequence, bytes);
  std::size_t at = start;
  for (const std::uint64_t word :
       std::bit_cast<std::array<std::uint64_t, sizeof frame / 8>>(frame)) {
    put(at, word);
    at += 8;
  }
  for (const SharedShape& object : objects) {
    for (const std::uint64_t word :
         {names, object.name.size(), positions, object.positions.size() / 3}) {
      put(at, word);
      at += 8;
    }
    put_name(start + names, object.name);
    names += rounded_up(object.name.size(), 8);
    for (std::size_t k = 0; k < object.positions.size(); ++k)
      put(start + positions + 8 * k, std::bit_cast<std::uint64_t>(object.positions[k]));
    positions += rounded_up(8 * object.positions.size(), line);
  }
  put(offsetof(SharedHead, sequence), frame.sequence);
  head_.begun = head_.sequence = frame.sequence;
}

} // namespace gewebe::formats
