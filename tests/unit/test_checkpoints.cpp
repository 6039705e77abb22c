// HDF5 files whose state at the last checkpoint survives, and names of partial results.

#include "base/error.h"
#include "formats/store/hdf5_internal.h"
#include "formats/stream/file_names.h"
#include "tests/unit/scratch.h"

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <span>
#include <string>
#include <sys/resource.h>
#include <vector>

namespace gewebe::test {
namespace {

std::uint64_t rows_after_restoring(const std::string& path, bool& refused) {
  refused = false;
  try {
    formats::hdf5::File file = formats::hdf5::File::reopen_checkpoint(path);
    const std::uint64_t rows = file.root().dataset("rows", formats::hdf5::Number::float64).rows();
    file.root().set("partial", "why");
    file.close();
    EXPECT_TRUE(formats::hdf5::File::open_own(path).root().has_attribute("partial"));
    return rows;
  } catch (const Error&) {
    refused = true;
    return 0;
  }
}

TEST(Checkpoints, WhatIsNotInACheckpointIsNotInTheFile) {
  const ScratchFile file(".h5");
  const auto copied = [&] {
    const ScratchFile copy(".h5"); // a new one each time
    std::filesystem::copy_file(file.path(), copy.path(),
                               std::filesystem::copy_options::overwrite_existing);
    bool refused = false;
    const std::uint64_t rows = rows_after_restoring(copy.path(), refused);
    return refused ? -1 : static_cast<int>(rows);
  };
  formats::hdf5::File made = formats::hdf5::File::create_with_checkpoints(file.path());
  formats::hdf5::Dataset rows =
      made.root().create_growing("rows", formats::hdf5::Number::float64, {}, 8);
  EXPECT_EQ(copied(), -1); // as of a run that was killed now
  const std::vector<double> some(100, 1.5);
  for (int k = 1; k <= 20; ++k) {
    rows.append(std::span<const double>(some));
    formats::hdf5::Group group = made.root().create_group("group" + std::to_string(k));
    EXPECT_EQ(copied(), k == 1 ? -1 : 100 * (k - 1)) << k;
    made.checkpoint();
    EXPECT_EQ(copied(), 100 * k) << k;
  }
  rows.append(std::span<const double>(some));
  made.abandon();
  bool refused = true;
  EXPECT_EQ(rows_after_restoring(file.path(), refused), 2000U);
}

/// Files of this process can't be longer while it lives, as on a full disk.
class FileLimit {
public:
  explicit FileLimit(std::uint64_t bytes) {
    (void)std::signal(SIGXFSZ, SIG_IGN);
    (void)::getrlimit(RLIMIT_FSIZE, &old_);
    rlimit now = old_;
    now.rlim_cur = bytes;
    (void)::setrlimit(RLIMIT_FSIZE, &now);
  }
  ~FileLimit() { (void)::setrlimit(RLIMIT_FSIZE, &old_); }
  FileLimit(const FileLimit&) = delete;
  FileLimit& operator=(const FileLimit&) = delete;

private:
  rlimit old_{};
};

// Large frames leave the room that was reserved, so that their own bytes can't be written, before
// any log of the checkpoint is.
TEST(Checkpoints, AFrameThatFindsNoRoomIsTold) {
  for (const std::size_t size : {100U, 20000U, 60000U}) {
    const ScratchFile file(".h5");
    formats::hdf5::File made = formats::hdf5::File::create_with_checkpoints(file.path());
    formats::hdf5::Dataset rows =
        made.root().create_growing("rows", formats::hdf5::Number::float64, {}, 1024);
    const std::vector<double> some(size, 1.5);
    std::uint64_t frames = 0;
    bool told = false;
    {
      const FileLimit limit(1U << 20);
      while (!told && frames < 2000) {
        try {
          rows.append(std::span<const double>(some));
          made.checkpoint();
          ++frames;
        } catch (const Error&) {
          told = true;
        }
      }
    }
    EXPECT_TRUE(told) << size;
    EXPECT_GT(frames, 0U) << size;
    made.abandon();
    bool refused = true;
    EXPECT_EQ(rows_after_restoring(file.path(), refused), frames * size) << size;
  }
}

TEST(Checkpoints, PartialNamesKeepTheSuffix) {
  EXPECT_EQ(formats::partial_name("run.h5"), "run.partial.h5");
  EXPECT_EQ(formats::partial_name("a.b/run"), "a.b/run.partial");
  EXPECT_EQ(formats::partial_name("a/warp.nii.gz"), "a/warp.partial.nii.gz");
  EXPECT_EQ(formats::partial_name(".gz"), ".gz.partial");
}

} // namespace
} // namespace gewebe::test
