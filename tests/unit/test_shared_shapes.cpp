// Shapes in a file that others map: no reader sees half of a frame.

#include "base/error.h"
#include "formats/results/shared_shapes.h"
#include "scratch.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <optional>
#include <string>
#include <sys/mman.h>
#include <sys/stat.h>
#include <thread>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

struct ReadFrame {
  formats::SharedFrame head;
  std::vector<std::string> names;
  std::vector<std::vector<double>> positions;
};

/// A reader as the header tells one what to do.
class Reader {
public:
  explicit Reader(const std::string& path) : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    map();
  }
  ~Reader() { (void)::munmap(memory_, bytes_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  std::size_t mapped() const { return bytes_; }

  /// \param hold called in the midst of it
  template <class Hold>
  std::optional<ReadFrame> read(Hold&& hold) {
    while (const std::uint64_t now = word(offsetof(formats::SharedHead, sequence))) {
      const std::size_t place =
          now % 2 == 1 ? offsetof(formats::SharedHead, odd) : offsetof(formats::SharedHead, even);
      const std::uint64_t offset = word(place), most = word(place + 8);
      if (offset + most > bytes_) {
        (void)::munmap(memory_, bytes_);
        map();
        continue;
      }
      std::vector<std::uint64_t> copy(most / 8);
      for (std::size_t k = 0; k < copy.size(); ++k) {
        if (k == copy.size() / 8)
          hold();
        copy[k] = word(offset + 8 * k);
      }
      if (word(offsetof(formats::SharedHead, begun)) < now + 2)
        return parsed(copy);
      ++again;
    }
    return std::nullopt;
  }

  std::size_t again = 0; ///< how often a frame was overwritten under it

private:
  void map() {
    struct stat info {};
    ASSERT_EQ(::fstat(file_.get(), &info), 0);
    bytes_ = static_cast<std::size_t>(info.st_size);
    memory_ = ::mmap(nullptr, bytes_, PROT_READ, MAP_SHARED, file_.get(), 0);
    ASSERT_NE(memory_, MAP_FAILED);
  }
  std::uint64_t word(std::size_t offset) const {
    return std::atomic_ref<std::uint64_t>(
               *reinterpret_cast<std::uint64_t*>(static_cast<char*>(memory_) + offset))
        .load(std::memory_order_acquire);
  }
  static ReadFrame parsed(const std::vector<std::uint64_t>& words) {
    const char* const bytes = reinterpret_cast<const char*>(words.data());
    ReadFrame frame;
    std::memcpy(&frame.head, bytes, sizeof frame.head);
    for (std::size_t k = 0; k < frame.head.objects; ++k) {
      formats::SharedObject object;
      std::memcpy(&object, bytes + sizeof frame.head + k * sizeof object, sizeof object);
      frame.names.emplace_back(bytes + object.name, object.name_bytes);
      std::vector<double>& positions = frame.positions.emplace_back(3 * object.nodes);
      EXPECT_EQ(object.positions % 64, 0U);
      EXPECT_LE(object.positions + 8 * positions.size(), frame.head.bytes);
      if (!positions.empty())
        std::memcpy(positions.data(), bytes + object.positions, 8 * positions.size());
    }
    return frame;
  }

  formats::Descriptor file_;
  void* memory_ = nullptr;
  std::size_t bytes_ = 0;
};

constexpr auto at_once = [] {};

/// The name of a file that is not there yet.
std::string new_path() {
  const ScratchFile file(".shapes");
  return file.path();
}

/// Objects whose coordinates are all the number of the frame.
void write_number(formats::SharedShapes& shapes, std::uint64_t number, std::size_t nodes,
                  std::size_t objects = 2) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < objects; ++k)
    names.push_back("object." + std::to_string(k));
  const std::vector<double> positions(3 * nodes, static_cast<double>(number));
  std::vector<formats::SharedShape> all;
  for (const std::string& name : names)
    all.push_back({name, positions});
  shapes.write(number, static_cast<double>(number), all, false);
}

/// All of one frame.
void expect_whole(const ReadFrame& frame) {
  const auto number = static_cast<double>(frame.head.sequence);
  EXPECT_EQ(frame.head.step, frame.head.sequence);
  EXPECT_EQ(frame.head.time, number);
  for (std::size_t k = 0; k < frame.positions.size(); ++k) {
    EXPECT_EQ(frame.names[k], "object." + std::to_string(k));
    const std::vector<double>& all = frame.positions[k];
    ASSERT_TRUE(std::all_of(all.begin(), all.end(), [&](double x) { return x == number; }))
        << "torn";
  }
}

TEST(SharedShapes, NoReaderSeesHalfOfAFrame) {
  const std::string path = new_path();
  formats::SharedShapes shapes(path);
  constexpr std::size_t readers = 3, wanted = 150;
  constexpr std::chrono::microseconds slower(10); // up to some frames
  std::array<std::size_t, readers> again{};
  std::atomic<std::size_t> ready{0}, done{0};
  const auto follow = [&](std::size_t k) {
    Reader reader(path);
    ++ready;
    std::uint64_t last = 0;
    for (std::size_t seen = 0, turn = 0; seen < wanted;) {
      const std::optional<ReadFrame> frame = reader.read([&] {
        const auto end = std::chrono::steady_clock::now() + k * (turn++ % 8) * slower;
        while (std::chrono::steady_clock::now() < end) {
        }
      });
      if (!frame)
        continue;
      ASSERT_GE(frame->head.sequence, last);
      seen += frame->head.sequence > last ? 1 : 0;
      last = frame->head.sequence;
      ASSERT_NO_FATAL_FAILURE(expect_whole(*frame));
    }
    again.at(k) = reader.again;
  };
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < readers; ++k)
    threads.emplace_back([&, k] {
      follow(k);
      ++done;
    });
  while (ready < readers)
    std::this_thread::yield();
  std::uint64_t frames = 0;
  while (done < readers) {
    ++frames; // now and then another layout
    write_number(shapes, frames, 1000 + frames / 200 % 50,
                 1 + std::min<std::uint64_t>(frames / 1000, 3));
    if (frames % 2 == 0)
      std::this_thread::yield();
  }
  for (std::thread& thread : threads)
    thread.join();
  EXPECT_GT(frames, wanted);
  EXPECT_GT(again[1] + again[2], 0U);
}

TEST(SharedShapes, AFrameIsOverwrittenByTheOneAfterTheNext) {
  const std::string path = new_path();
  formats::SharedShapes shapes(path);
  Reader reader(path);
  EXPECT_FALSE(reader.read(at_once));
  write_number(shapes, 1, 30);
  const auto read_while_written = [&](std::vector<std::uint64_t> numbers) {
    return reader.read([&] {
      for (const std::uint64_t k : std::exchange(numbers, {}))
        write_number(shapes, k, 30);
    });
  };
  // The next one leaves it whole,
  std::optional<ReadFrame> frame = read_while_written({2});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->head.sequence, 1U);
  expect_whole(*frame);
  EXPECT_EQ(reader.again, 0U);
  // the one after that does not, which the reader sees.
  frame = read_while_written({3, 4});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->head.sequence, 4U);
  expect_whole(*frame);
  EXPECT_EQ(reader.again, 1U);
}

TEST(SharedShapes, AnotherLayoutIsAnotherGeneration) {
  const std::string path = new_path();
  formats::SharedShapes shapes(path);
  Reader reader(path);
  const std::vector<double> two{1, 2, 3, 4, 5, 6}, one{7, 8, 9};
  const auto generation = [&](const std::vector<formats::SharedShape>& all, bool changed = false) {
    shapes.write(1, 0.5, all, changed);
    const ReadFrame frame = reader.read(at_once).value();
    EXPECT_EQ(frame.positions.size(), all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
      EXPECT_EQ(frame.names[k], all[k].name);
      EXPECT_EQ(frame.positions[k],
                std::vector<double>(all[k].positions.begin(), all[k].positions.end()));
    }
    return frame.head.generation;
  };
  EXPECT_EQ(generation({}), 1U);
  EXPECT_EQ(generation({{"a", two}}), 2U);
  EXPECT_EQ(generation({{"a", two}}), 2U);
  EXPECT_EQ(generation({{"a", one}}), 3U);
  EXPECT_EQ(generation({{"b", one}}), 4U);
  EXPECT_EQ(generation({{"b", one}}, true), 5U);
  EXPECT_EQ(generation({{"b", one}, {"a-name-of-more-than-eight-bytes", two}}), 6U);
  EXPECT_EQ(generation({{"b", one}, {"empty", {}}}), 7U);
  // A larger frame lies behind what was mapped.
  const std::size_t before = reader.mapped();
  const std::vector<double> many(300000, 0.25);
  EXPECT_EQ(generation({{"b", many}}), 8U);
  EXPECT_GT(reader.mapped(), before);
}

TEST(SharedShapes, TheFileIsItsOwners) {
  const std::string path = new_path(), left = path + ".left";
  {
    const formats::SharedShapes shapes(path);
    struct stat info {};
    ASSERT_EQ(::stat(path.c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777U, 0600U);
    EXPECT_THROW(formats::SharedShapes{path}, Error);
    EXPECT_TRUE(std::filesystem::exists(path));
    std::filesystem::copy_file(path, left);
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  {
    formats::SharedShapes replaced(left);
    write_number(replaced, 1, 3);
    EXPECT_EQ(Reader(left).read(at_once).value().head.sequence, 1U);
  }
  EXPECT_FALSE(std::filesystem::exists(left));
  std::ofstream(path) << "GWBSHAP";
  try {
    const formats::SharedShapes shapes(path);
    FAIL() << "a file of another kind is replaced";
  } catch (const Error& error) {
    EXPECT_EQ(error.place(), path);
  }
  std::ifstream kept(path);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(kept), {}), "GWBSHAP");
  std::filesystem::remove(path);
}

} // namespace
} // namespace gewebe::test
