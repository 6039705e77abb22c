#pragma once
// Clients that drive a scene by a socket, one after the other: ffe-run --listen, gewebe_serve(5).

#include "tools/run/scene_run.h"
#include "tools/serve/local_socket.h"
#include "tools/serve/scene_lines.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <poll.h>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::cli {

struct SceneClientsOptions {
  bool binary = false;                ///< what is said beside the answers, too
  std::size_t most_unread = 1U << 24; ///< bytes of answers that wait for a client to read
  bool awake = false;                 ///< wait without sleep
  double patience = 10;               ///< s that a client with more of them may read nothing
  std::function<void(const std::string&)> warn{};
};

/// One client at a time has the scene; others get the answer busy. One that goes, in whatever
/// way, leaves the scene as its whole lines have made it.
class SceneClients {
public:
  /// Listens from now on. \throw Error as LocalListener
  SceneClients(const std::string& path, SceneClientsOptions options);

  /// Until a client ends the run. \throw Error as the run
  void serve(SceneRun& run);
  /// Whether a line of a client is carried out, so that answers are meant for it.
  bool serving() const noexcept { return serving_; }
  /// To the client, if it is still there.
  void reply(std::string_view bytes);
  /// Whether the client that is served has gone.
  bool gone() const noexcept { return serving_ && !client_; }

private:
  void wait();
  void take_lines(SceneRun& run);
  void let_in(SceneRun& run);
  void turn_away();
  bool refused(const LocalListener::Arrival& next) const;
  void say(const formats::Descriptor& to, const std::string& text) const;
  void drop(const std::string& why);
  void flush(std::size_t most);
  bool hung_up() const;
  pollfd others() const;

  SceneClientsOptions options_;
  LocalListener listener_;
  formats::Descriptor client_;
  LocalListener::Arrival next_{}; ///< accepted already, let in when the client has gone
  std::vector<char> buffer_;      ///< of what the client sends
  std::optional<SceneLines> lines_;
  std::string unread_;        ///< answers that wait
  std::uint64_t clients_ = 0; ///< that were let in
  bool leaving_ = false;      ///< no more lines come, but answers are to be read
  bool serving_ = false;
};

} // namespace gewebe::cli
