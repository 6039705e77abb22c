// Small things of the base: sizes, digests, parallel blocks, places of errors.

#include "base/bytes.h"
#include "base/context.h"
#include "base/digest.h"
#include "base/error.h"
#include "base/parallel.h"
#include "base/team.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <numeric>
#include <thread>
#include <utility>
#include <vector>

using namespace gewebe;

TEST(Bytes, SizesAsPeopleWriteThem) {
  EXPECT_EQ(bytes_from_text("1000"), 1000U);
  EXPECT_EQ(bytes_from_text("4G"), 4ULL << 30U);
  EXPECT_EQ(bytes_from_text("1.5MiB"), 3ULL << 19U);
  EXPECT_EQ(bytes_from_text("2kB"), 2048U);
  for (const char* bad : {"", "G", "-1", "nan", "inf", "1X", "1GG", "1e400", "0", "4 G"})
    EXPECT_THROW((void)bytes_from_text(bad), Error) << bad;
  EXPECT_EQ(bytes_text(512), "512 B");
  EXPECT_EQ(bytes_text(1536), "1.5 KiB");
}

TEST(Digest, IsXxh3) {
  EXPECT_EQ(Digest().hex(), "2d06800538d394c2"); // XXH3-64 of nothing
  Digest a;
  a.add_bytes("gewebe", 6);
  Digest b;
  b.add_bytes("gew", 3);
  b.add_bytes("ebe", 3);
  EXPECT_EQ(a.value(), b.value());
  EXPECT_NE(a.value(), Digest().value());
}

TEST(Parallel, BlocksDependOnTheGrainAlone) {
  for (const int threads : {1, 2, 5}) {
    Context context;
    context.threads = threads;
    std::vector<int> hits(1003, 0);
    std::vector<std::size_t> ends(11, 0);
    parallel_blocks(context, hits.size(), 100, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        ++hits[n];
      ends[begin / 100] = end;
    });
    EXPECT_EQ(std::accumulate(hits.begin(), hits.end(), 0), 1003);
    EXPECT_EQ(ends.back(), 1003U);
    EXPECT_EQ(ends[3], 400U);
  }
  parallel_blocks({}, 0, 8, [](std::size_t, std::size_t) { FAIL(); });
}

TEST(Parallel, WhatIsNotWorthItStaysOnThisThread) {
  Context context;
  context.threads = 4;
  std::vector<std::size_t> begins;
  bool here = true;
  const auto id = std::this_thread::get_id();
  parallel_blocks_if(false, context, 1000, 8, [&](std::size_t begin, std::size_t end) {
    here = here && std::this_thread::get_id() == id && end == begin + 8;
    begins.push_back(begin);
  });
  EXPECT_TRUE(here);
  ASSERT_EQ(begins.size(), 125U);
  EXPECT_TRUE(std::ranges::is_sorted(begins));
}

TEST(Parallel, ProgressIsToldByOneThreadAtATime) {
  Context context;
  context.threads = 4;
  std::atomic<int> inside{0};
  std::atomic<bool> together{false};
  std::vector<double> told;
  context.progress = [&](double done) {
    together = together || ++inside > 1;
    std::this_thread::sleep_for(std::chrono::milliseconds(1)); // time for another to come in
    told.push_back(done);
    --inside;
  };
  parallel_blocks(context, 64, 1, [](std::size_t, std::size_t) {});
  EXPECT_FALSE(together);
  ASSERT_EQ(told.size(), 64U);
  for (std::size_t n = 0; n < told.size(); ++n)
    EXPECT_EQ(told[n], static_cast<double>(n + 1) / 64);
}

TEST(Parallel, ErrorsAndCancellingComeThrough) {
  EXPECT_THROW(parallel_blocks({}, 100, 1,
                               [](std::size_t b, std::size_t) {
                                 if (b == 50)
                                   throw Error("no");
                               }),
               Error);
  Context context;
  std::atomic<int> asked{0};
  context.cancelled = [&] { return ++asked > 3; };
  EXPECT_THROW(parallel_blocks(context, 100, 1, [](std::size_t, std::size_t) {}), Cancelled);
}

TEST(Team, EachBlockOfManyShortLoopsIsDoneOnceBeforeTheNextLoop) {
  for (const int threads : {1, 2, 5}) {
    Context context;
    context.threads = threads;
    std::vector<std::size_t> done(203, 0);
    std::size_t wrong = 0;
    lead_team(context, [&](Team& team) {
      EXPECT_EQ(team.alone(), threads == 1);
      for (std::size_t loop = 0; loop < 5000; ++loop) {
        const std::size_t count = loop % 203 + 1, grain = loop % 7 + 1;
        team.blocks(count, grain, [&](std::size_t begin, std::size_t end) {
          for (std::size_t n = begin; n < end; ++n)
            done[n] += begin % grain == 0 && end <= begin + grain ? 1 : 1000;
        });
        for (std::size_t n = 0; n < done.size(); ++n)
          wrong += std::exchange(done[n], 0) != (n < count ? 1U : 0U) ? 1 : 0;
      }
      team.blocks(0, 8, [](std::size_t, std::size_t) { FAIL(); });
    });
    EXPECT_EQ(wrong, 0U) << threads;
  }
}

namespace {

/// Whether another thread takes a block within half a minute.
bool others_help() {
  Context context;
  context.threads = 2;
  bool helped = false;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  lead_team(context, [&](Team& team) {
    const auto leader = std::this_thread::get_id();
    std::atomic<bool> other = false;
    while (!helped && std::chrono::steady_clock::now() < until) {
      team.blocks(2, 1, [&](std::size_t, std::size_t) {
        if (std::this_thread::get_id() != leader)
          other = true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1)); // time for another to take one
      });
      helped = other;
    }
  });
  return helped;
}

} // namespace

/// In a process of its own: on a busy machine TBB's threads stay with the loops of earlier tests
/// for many seconds.
TEST(Team, OthersHelpTheOneThatLeads) {
  if (std::thread::hardware_concurrency() < 2)
    GTEST_SKIP() << "there is one processor";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(std::_Exit(others_help() ? 0 : 1), testing::ExitedWithCode(0), "");
}

TEST(Team, ErrorsAndCancellingComeThrough) {
  Context context;
  context.threads = 2;
  std::atomic<int> done = 0;
  lead_team(context, [&](Team& team) {
    EXPECT_THROW(team.blocks(100, 1,
                             [](std::size_t b, std::size_t) {
                               if (b == 50)
                                 throw Error("no");
                             }),
                 Error);
    team.blocks(100, 1, [&](std::size_t, std::size_t) { ++done; }); // and it goes on
  });
  EXPECT_EQ(done, 100);
  EXPECT_THROW(lead_team(context, [](Team&) { throw Error("no"); }), Error);
  context.cancelled = [] { return true; };
  EXPECT_THROW(lead_team(context, [](Team&) {}), Cancelled);
}

TEST(Error, PlaceIsAddedOnce) {
  try {
    at("outer", [] { at("inner", [] { throw Error("wrong"); }); });
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.place(), "inner");
    EXPECT_STREQ(error.what(), "wrong");
  }
  EXPECT_EQ(at("x", [] { return 3; }), 3);
}

TEST(Memory, LimitIsNamed) {
  Context context;
  context.max_memory = 1 << 20;
  EXPECT_NO_THROW(require_memory(context, 1e6, "it"));
  EXPECT_THROW(require_memory(context, 1e7, "it"), Error);
}

TEST(Cpu, LevelsHaveNames) {
  EXPECT_EQ(cpu_level_from_name("baseline"), CpuLevel::baseline);
  EXPECT_LE(cpu_level_from_name("avx512"), best_cpu_level());
  EXPECT_THROW((void)cpu_level_from_name("sse"), Error);
}
