// Files, pipes and atomic output.

#include "base/error.h"
#include "formats/stream/stream.h"
#include "tests/unit/scratch.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <istream>
#include <iterator>
#include <ostream>
#include <sys/stat.h>
#include <thread>

using namespace gewebe;
namespace fs = std::filesystem;

namespace {

/// An empty folder of the test's own.
class ScratchFolder {
public:
  ScratchFolder() : path_(fs::temp_directory_path() / "gewebe-test-XXXXXX") {
    std::string name = path_.string();
    if (::mkdtemp(name.data()) == nullptr)
      throw std::runtime_error("no scratch folder");
    path_ = name;
  }
  ~ScratchFolder() { fs::remove_all(path_); }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  std::size_t count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(path_), {}));
  }

private:
  fs::path path_;
};

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void put(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
}

} // namespace

// More than a pipe or the first pages hold, from a file, whose size is known, and from a FIFO.
TEST(Stream, ManyBytesComeWhole) {
  const ScratchFolder folder;
  std::string text(9'000'001, ' ');
  for (std::size_t k = 0; k < text.size(); ++k)
    text[k] = static_cast<char>(k * 2'654'435'761U >> 16U);
  put(folder / "file", text);
  ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
  std::thread writer([&] { put(folder / "fifo", text); });
  {
    formats::Input fifo(folder / "fifo");
    EXPECT_EQ(fifo.peek(3), text.substr(0, 3));
    EXPECT_TRUE(fifo.read_all_pages().view() == text);
  }
  writer.join();
  EXPECT_TRUE(formats::Input(folder / "file").read_all_pages().view() == text);
  EXPECT_TRUE(formats::Input(folder / "file").read_all_pages(text.size()).view() == text);
  EXPECT_THROW((void)formats::Input(folder / "file").read_all_pages(text.size() - 1), Error);
  put(folder / "empty", "");
  EXPECT_THROW((void)formats::Input(folder / "empty").read_all_pages(), Error);
}

TEST(Stream, OutputAppearsWholeOrNotAtAll) {
  const ScratchFolder folder;
  const std::string path = folder / "a";
  put(path, "old");
  {
    formats::Output output(path, {});
    output.write("new");
    EXPECT_EQ(content(path), "old");
    EXPECT_EQ(folder.count(), 2U); // the temporary file beside it
  }
  EXPECT_EQ(content(path), "old"); // no commit, no change
  EXPECT_EQ(folder.count(), 1U);
  formats::Output output(path, {});
  output.write("new");
  output.commit();
  EXPECT_EQ(content(path), "new");
  EXPECT_EQ(folder.count(), 1U);
}

TEST(Stream, ModeIsTheOldOneOrTheMask) {
  const ScratchFolder folder;
  const auto mode = [](const std::string& path) {
    struct stat info {};
    EXPECT_EQ(::stat(path.c_str(), &info), 0);
    return info.st_mode & 0777U;
  };
  const mode_t mask = ::umask(027);
  formats::Output fresh(folder / "fresh", {});
  fresh.commit();
  EXPECT_EQ(mode(folder / "fresh"), 0640U);
  put(folder / "old", "x");
  ASSERT_EQ(::chmod((folder / "old").c_str(), 0604), 0);
  formats::Output again(folder / "old", {});
  again.commit();
  EXPECT_EQ(mode(folder / "old"), 0604U);
  (void)::umask(mask);
}

TEST(Stream, SymlinkStaysAndItsTargetIsWritten) {
  const ScratchFolder folder;
  fs::create_directory(folder / "d");
  fs::create_symlink("d/target", folder / "link");
  formats::Output output(folder / "link", {});
  output.write("x");
  output.commit();
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(content(folder / "d/target"), "x");
}

TEST(Stream, KeepUnchangedLeavesTheTimeStamp) {
  const ScratchFolder folder;
  const std::string path = folder / "a";
  put(path, "same");
  const auto old_time = fs::file_time_type::clock::now() - std::chrono::hours(1);
  fs::last_write_time(path, old_time);
  const auto write = [&](const char* text) {
    formats::Output output(path, {.keep_unchanged = true});
    output.write(text);
    output.commit();
  };
  const auto before = fs::last_write_time(path);
  write("same");
  EXPECT_EQ(fs::last_write_time(path), before);
  EXPECT_EQ(folder.count(), 1U);
  write("other");
  EXPECT_NE(fs::last_write_time(path), before);
  EXPECT_EQ(content(path), "other");
}

TEST(Stream, FifoIsWrittenDirectly) {
  const ScratchFolder folder;
  const std::string path = folder / "fifo";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = formats::Input(path).read_all(); });
  formats::Output output(path, {});
  output.stream() << "through";
  output.commit();
  reader.join();
  EXPECT_EQ(got, "through");
  EXPECT_TRUE(fs::is_fifo(path));
}

TEST(Stream, FailuresNameTheFile) {
  const ScratchFolder folder;
  EXPECT_THROW(formats::Input(folder / "none"), Error);
  EXPECT_THROW(formats::Input(folder / ""), Error); // a directory
  EXPECT_THROW(formats::Output(folder / "", {}), Error);
  EXPECT_THROW(formats::Output(folder / "none/a", {}), Error);
  put(folder / "empty", "");
  formats::Input empty(folder / "empty");
  EXPECT_THROW((void)empty.read_all(), Error);
  formats::Output full("/dev/full", {});
  full.write("x");
  try {
    full.commit();
    FAIL() << "/dev/full took a byte";
  } catch (const Error& error) {
    EXPECT_EQ(error.place(), "/dev/full");
    EXPECT_NE(std::string(error.what()).find("No space left"), std::string::npos);
  }
}

TEST(Stream, PeekConsumesNothing) {
  const ScratchFolder folder;
  std::string text;
  for (int n = 0; n < 700000; ++n)
    text += std::to_string(n) + ' ';
  put(folder / "a", text);
  formats::Input input(folder / "a");
  EXPECT_EQ(input.peek(4), text.substr(0, 4));
  EXPECT_EQ(input.peek(4096), text.substr(0, 4096));
  EXPECT_EQ(input.read_all(), text);
  formats::Input again(folder / "a");
  EXPECT_EQ(again.peek(10), text.substr(0, 10));
  std::string streamed(std::istreambuf_iterator<char>(again.stream()), {});
  EXPECT_EQ(streamed, text);
  formats::Input limited(folder / "a");
  EXPECT_THROW((void)limited.read_all(1000), Error);
}
