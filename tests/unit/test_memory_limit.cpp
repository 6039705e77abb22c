// The default of --max-memory, and the account of what parallel work allocates.

#include "base/error.h"
#include "base/memory_account.h"
#include "tests/unit/sanitizers.h"
#include "tools/cli/memory_limit.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <sys/resource.h>
#include <utility>

namespace gewebe::test {
namespace {

namespace fs = std::filesystem;
constexpr std::uint64_t gib = std::uint64_t{1} << 30;

/// Files of /proc and /sys that a test makes up.
class MadeSystem {
public:
  MadeSystem() {
    std::string name = (fs::temp_directory_path() / "gewebe-test-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw std::runtime_error("no scratch folder");
    root_ = name;
    put("/proc/meminfo", "MemTotal: 16777216 kB\nMemFree: 1 kB\nMemAvailable: 8388608 kB\n");
  }
  ~MadeSystem() { fs::remove_all(root_); }
  MadeSystem(const MadeSystem&) = delete;
  MadeSystem& operator=(const MadeSystem&) = delete;

  void put(const std::string& path, const std::string& text) const {
    fs::create_directories(fs::path(root_ + path).parent_path());
    std::ofstream(root_ + path) << text;
  }
  void group(const std::string& path, std::uint64_t limit, std::uint64_t used,
             std::uint64_t cache) const {
    put("/sys/fs/cgroup" + path + "/memory.max", std::to_string(limit) + "\n");
    put("/sys/fs/cgroup" + path + "/memory.current", std::to_string(used) + "\n");
    put("/sys/fs/cgroup" + path + "/memory.stat",
        "anon 1\ninactive_file " + std::to_string(cache) + "\nactive_file 7\n");
  }
  std::uint64_t available() const { return cli::available_memory(root_); }

private:
  std::string root_;
};

TEST(MemoryLimit, WhatTheMachineHasAvailable) {
  EXPECT_EQ(MadeSystem().available(), 8 * gib);
}

TEST(MemoryLimit, ControlGroupsOfVersion2AndThoseAbove) {
  const MadeSystem system;
  system.put("/proc/self/cgroup", "0::/a/b\n");
  system.group("/a/b", 5 * gib, 2 * gib, 0);
  EXPECT_EQ(system.available(), 3 * gib);
  system.group("/a", 2 * gib, gib, 0); // the limit of a group holds for those below
  EXPECT_EQ(system.available(), gib);
  system.group("/a", 2 * gib, 2 * gib, gib + gib / 2); // the cache of files can be dropped
  EXPECT_EQ(system.available(), gib + gib / 2);
  system.put("/sys/fs/cgroup/a/memory.max", "max\n");
  EXPECT_EQ(system.available(), 3 * gib);
  system.group("", gib, gib / 4, 0); // a container's own mount
  EXPECT_EQ(system.available(), gib / 4 * 3);
}

TEST(MemoryLimit, ControlGroupsOfVersion1) {
  const MadeSystem system;
  system.put("/proc/self/cgroup", "5:cpu,cpuacct:/x\n4:memory:/jobs/7\n1:name=systemd:/\n0::/\n");
  const std::string folder = "/sys/fs/cgroup/memory/jobs/7";
  system.put(folder + "/memory.limit_in_bytes", std::to_string(4 * gib));
  system.put(folder + "/memory.usage_in_bytes", std::to_string(3 * gib));
  EXPECT_EQ(system.available(), gib);
  system.put(folder + "/memory.stat", "cache 5\ntotal_inactive_file " + std::to_string(gib) + "\n");
  EXPECT_EQ(system.available(), 2 * gib);
  system.put(folder + "/memory.limit_in_bytes", "9223372036854771712"); // no limit
  EXPECT_EQ(system.available(), 8 * gib);
}

TEST(MemoryLimit, LimitsOfTheProcess) {
  if (test::under_sanitizers())
    GTEST_SKIP() << "a sanitizer's shadow takes terabytes of address space";
  const MadeSystem system;
  for (const auto& [what, name] : {std::pair(RLIMIT_AS, "VmSize:"), {RLIMIT_DATA, "VmData:"}}) {
    // This process may have used much before; it has 6 GiB more.
    std::uint64_t used = 0;
    std::ifstream status("/proc/self/status");
    for (std::string word; used == 0 && status >> word;)
      if (word == name)
        status >> used;
    ASSERT_GT(used, 0U);
    rlimit before{};
    ASSERT_EQ(::getrlimit(what, &before), 0);
    rlimit small = before;
    small.rlim_cur = 1024 * used + 6 * gib;
    ASSERT_EQ(::setrlimit(what, &small), 0);
    const std::uint64_t available = system.available();
    (void)::setrlimit(what, &before);
    EXPECT_LT(available, 5 * gib + gib / 2); // of 6 * 7 / 8
    EXPECT_GT(available, 5 * gib);
  }
}

TEST(MemoryLimit, AnAccountRefusesWhatExceedsTheLimit) {
  Context context;
  context.max_memory = 1000;
  MemoryAccount account(context, "the band");
  MemoryShare first(account);
  first.add(600);
  {
    MemoryShare second(account);
    second.add(400);
    EXPECT_THROW(second.add(1), Error);
    EXPECT_THROW(second.add(UINT64_MAX), Error);
    MemoryShare third = std::move(second);
    second = MemoryShare(account);
  }
  EXPECT_NO_THROW(first.add(400));
  try {
    first.add(1);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the band needs more than the limit of 1000 B (--max-memory)");
  }
  MemoryShare without;
  EXPECT_NO_THROW(without.add(UINT64_MAX));
}

} // namespace
} // namespace gewebe::test
