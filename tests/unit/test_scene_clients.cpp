// Socket clients of a scene: how long a client may leave answers unread.

#include "scratch.h"
#include "sim_models.h"
#include "tools/run/scene_run.h"
#include "tools/serve/scene_clients.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <mutex>
#include <string>
#include <string_view>
#include <sys/socket.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace gewebe::test {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

/// Server of a scene whose answer to `sync` has `much` bytes, several times the size of a socket
/// buffer, and a client that reads it. The clock of the client judges, so load changes no verdict.
class Conversation {
public:
  explicit Conversation(double patience) : clients_(path_, options(patience)) {
    server_ = std::thread([this] { serve(); });
    client_ = connect();
    request("object two two.ela\nsync\n");
  }

  /// Ends the run, through another client where this one was dropped.
  ~Conversation() {
    if (!open_) {
      (void)::close(client_);
      client_ = connect();
    }
    request("end\n");
    server_.join();
    (void)::close(client_);
  }

  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  /// Reads what is there, at most `step` bytes. \return false at the end
  bool read() {
    const Clock::time_point start = Clock::now();
    for (std::size_t taken = 0; open_ && taken < step;) {
      const ssize_t got = ::recv(client_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
      open_ = got != 0 && (got > 0 || errno == EAGAIN);
      if (got <= 0)
        break;
      taken += static_cast<std::size_t>(got);
      for (const char c : std::string_view(buffer_.data(), static_cast<std::size_t>(got)))
        bytes_ += c == '.' ? 1U : 0U;
    }
    pause_ = std::max<Clock::duration>(pause_, Clock::now() - last_);
    last_ = start;
    return open_ && bytes_ < much;
  }

  std::size_t bytes() const { return bytes_; } ///< of the answer
  /// The longest time from the start of one read to the end of the next.
  Clock::duration longest_pause() const { return pause_; }
  bool is_open() const { return open_; } ///< as far as was read
  std::vector<std::string> warnings() {
    const std::lock_guard lock(mutex_);
    return warnings_;
  }

  static constexpr std::size_t step = 1U << 18U;
  static constexpr std::size_t much = 60 * step;

private:
  cli::SceneClientsOptions options(double patience) {
    cli::SceneClientsOptions result;
    result.most_unread = 0;
    result.patience = patience;
    result.warn = [this](const std::string& text) {
      const std::lock_guard lock(mutex_);
      warnings_.push_back(text);
    };
    return result;
  }

  void serve() {
    cli::SceneOptions scene;
    scene.files.model = [](const std::string&) { return test::two_masses(); };
    scene.serve = true;
    scene.acknowledge = true;
    scene.reply = [this](std::string_view text) {
      clients_.reply(text.starts_with("ok 2") ? std::string(much, '.') : std::string(text));
    };
    cli::SceneRun run("scene", test::one_thread(), scene);
    clients_.serve(run);
  }

  int connect() const {
    const int client = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::connect(client, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return client;
  }

  void request(std::string_view text) const {
    EXPECT_EQ(::send(client_, text.data(), text.size(), MSG_NOSIGNAL), std::ssize(text));
  }

  ScratchFile file_;
  std::string path_ = file_.path() + ".socket";
  std::mutex mutex_;
  std::vector<std::string> warnings_;
  cli::SceneClients clients_;
  std::thread server_;
  int client_ = -1;
  std::array<char, 1U << 16U> buffer_{};
  bool open_ = true;
  std::size_t bytes_ = 0;
  Clock::duration pause_{};
  Clock::time_point last_ = Clock::now();
};

void sleep(double seconds) {
  std::this_thread::sleep_for(Seconds(seconds));
}

/// Each read restarts the patience of the server, so the whole answer may take longer. An attempt
/// in which the machine held up the reader for half of the patience proves nothing.
TEST(SceneClients, ASlowReaderIsNotDropped) {
  constexpr double patience = 1;
  for (int attempt = 0; attempt < 20; ++attempt) {
    Conversation slow(patience);
    const Clock::time_point start = Clock::now();
    bool more = true;
    while (more && Clock::now() - start < Seconds(1.6 * patience)) {
      sleep(0.04 * patience);
      more = slow.read();
    }
    EXPECT_TRUE(more || !slow.is_open()) << "the answer is too short";
    while (more) {
      sleep(1e-3);
      more = slow.read();
    }
    if (slow.longest_pause() >= Seconds(patience / 2))
      continue;
    EXPECT_EQ(slow.warnings(), std::vector<std::string>{});
    EXPECT_EQ(slow.bytes(), Conversation::much);
    return;
  }
  FAIL() << "the machine is too busy";
}

TEST(SceneClients, AClientThatReadsNothingIsDropped) {
  Conversation silent(0.2);
  for (int wait = 0; silent.warnings().empty() && wait < 6000; ++wait)
    sleep(0.01);
  while (silent.read()) {
  }
  EXPECT_EQ(silent.warnings(),
            std::vector<std::string>{"client 1 read nothing for 0.2 s while answers waited, it is "
                                     "dropped"});
  EXPECT_LT(silent.bytes(), Conversation::much);
}

} // namespace
} // namespace gewebe::test
