// Socket clients of a scene: how long a client may leave answers unread.

#include "base/error.h"
#include "scratch.h"
#include "sim_models.h"
#include "tools/run/scene_clients.h"
#include "tools/run/scene_run.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <sys/socket.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace gewebe {
namespace {

constexpr std::size_t much = 1400000; ///< bytes, several times the size of a socket buffer

struct Slow {
  std::size_t read = 0; ///< bytes of the answer
  std::vector<std::string> warnings;
};

/// A client that requests an answer of `much` bytes and drains its socket every `sleep` seconds.
Slow read_slowly(double patience, double sleep) {
  const ScratchFile file;
  const std::string path = file.path() + ".socket";
  Slow result;
  SceneClientsOptions options;
  options.most_unread = 0;
  options.patience = patience;
  options.warn = [&](const std::string& text) { result.warnings.push_back(text); };
  SceneClients clients(path, options);
  SceneOptions scene;
  scene.files.model = [](const std::string&) { return test::two_masses(); };
  scene.serve = true;
  scene.acknowledge = true;
  scene.reply = [&](std::string_view text) {
    clients.reply(text.starts_with("ok 2") ? std::string(much, '.') : std::string(text));
  };
  SceneRun run("scene", test::one_thread(), scene);
  std::thread server([&] { clients.serve(run); });

  const auto connected = [&] {
    const int client = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::connect(client, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return client;
  };
  const auto send = [](int client, std::string_view text) {
    EXPECT_EQ(::send(client, text.data(), text.size(), MSG_NOSIGNAL), std::ssize(text));
  };
  int client = connected();
  send(client, "object two two.ela\nsync\n");
  std::array<char, 1U << 16U> buffer;
  for (bool open = true; open && result.read < much;) {
    std::this_thread::sleep_for(std::chrono::duration<double>(sleep));
    for (;;) {
      const ssize_t got = ::recv(client, buffer.data(), buffer.size(), MSG_DONTWAIT);
      open = got != 0;
      if (got <= 0)
        break;
      for (const char c : std::string_view(buffer.data(), static_cast<std::size_t>(got)))
        result.read += c == '.' ? 1U : 0U;
    }
  }
  if (!result.warnings.empty()) { // it was dropped, and another one ends the run
    (void)::close(client);
    client = connected();
  }
  send(client, "end\n");
  server.join();
  (void)::close(client);
  return result;
}

/// Each read restarts the patience of the server, so the whole answer may take longer.
TEST(SceneClients, ASlowReaderIsNotDropped) {
  const auto start = std::chrono::steady_clock::now();
  const Slow slow = read_slowly(1.2, 0.25);
  EXPECT_EQ(slow.warnings, std::vector<std::string>{});
  EXPECT_EQ(slow.read, much);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  EXPECT_GT(took.count(), 1.2) << "the answer fits into the system's buffers";
}

TEST(SceneClients, AClientThatReadsNothingIsDropped) {
  const Slow slow = read_slowly(0.2, 0.8);
  EXPECT_EQ(slow.warnings,
            std::vector<std::string>{"client 1 read nothing for 0.2 s while answers waited, it is "
                                     "dropped"});
  EXPECT_LT(slow.read, much);
}

} // namespace
} // namespace gewebe
