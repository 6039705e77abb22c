#include "tools/serve/scene_clients.h"

#include "formats/scene/frames_binary.h"
#include "formats/scene/scene_answer.h"
#include "formats/stream/removal.h"
#include "text/number_text.h"
#include "tools/run/step_latency.h"

#include <array>
#include <chrono>
#include <cmath>
#include <poll.h>
#include <utility>

namespace gewebe::cli {

namespace {

constexpr std::size_t block = 1U << 16U;

/// Waits for one of them. \return false where it took longer \throw Cancelled on a signal
bool wait_for(const std::array<pollfd, 2>& who, double seconds) {
  const int limit = seconds < 0 ? -1 : static_cast<int>(std::ceil(seconds * 1000));
  std::array<pollfd, 3> all{who[0], who[1],
                            pollfd{formats::deferred_signal_descriptor(), POLLIN, 0}};
  const bool any = ::poll(all.data(), all.size(), limit) != 0;
  formats::check_deferred_signal();
  return any; // an interruption is no end of patience
}

} // namespace

SceneClients::SceneClients(const std::string& path, SceneClientsOptions options)
    : options_(std::move(options)), listener_(path), buffer_(block) {}

void SceneClients::serve(SceneRun& run) {
  serving_ = true;
  while (!run.ended()) {
    wait();
    if (client_ && !leaving_)
      take_lines(run);
    if (client_ && leaving_ && unread_.empty())
      client_ = formats::Descriptor();
    if (client_)
      turn_away();
    else
      let_in(run);
  }
  flush(0);
  client_ = formats::Descriptor();
  next_ = {};
  serving_ = false;
}

/// For a client, or what is to be done for the one that is there.
void SceneClients::wait() {
  const short client =
      static_cast<short>((leaving_ ? 0 : POLLIN) | (unread_.empty() ? 0 : POLLOUT));
  std::array<pollfd, 2> who{pollfd{client_.get(), client, 0}, others()};
  if (options_.awake && client_ && !leaving_)
    while (!wait_for(who, 0)) {
    }
  else if (!wait_for(who, leaving_ ? options_.patience : -1))
    return drop("read nothing more for " + text::number_text(options_.patience) + " s");
  if (client_ && !unread_.empty() && send_some(client_, unread_) == Transfer::over)
    drop("");
}

void SceneClients::take_lines(SceneRun& run) {
  const Received came = receive_some(client_, buffer_);
  if (came.how == Transfer::some && run.latency() != nullptr)
    run.latency()->line_arrived();
  for (const char c : came.bytes) {
    if (!client_ || run.ended())
      return;
    if (!lines_->take(c))
      return drop("sent a line of over 1 GiB");
  }
  if (came.how != Transfer::over)
    return;
  lines_->drop(); // a line without its end may be half of one
  leaving_ = true;
}

void SceneClients::let_in(SceneRun& run) {
  LocalListener::Arrival next = next_.client ? std::exchange(next_, {}) : listener_.accept();
  if (!next.client || refused(next))
    return;
  client_ = std::move(next.client);
  lines_.emplace(run);
  unread_.clear();
  leaving_ = false;
  ++clients_;
  run.next_client();
  reply(options_.binary ? formats::binary_sync(run.simulation(), run.steps())
                        : formats::text_ready(run.simulation()));
}

/// Connecting clients, except those that wait for the present one: they must not wake the thread.
pollfd SceneClients::others() const {
  return {client_ && hung_up() ? -1 : listener_.descriptor(), POLLIN, 0};
}

/// Those that come while the scene has its client; not while that one is on its way out. A client
/// that came after it hung up is accepted then, so the state is checked again after each.
void SceneClients::turn_away() {
  while (!hung_up()) {
    LocalListener::Arrival other = listener_.accept();
    if (!other.client)
      return;
    if (hung_up()) {
      next_ = std::move(other);
      return;
    }
    say(other.client,
        foreign_peer(other.client).value_or("busy, the scene has a client, expected none"));
  }
}

/// Refuses a client that may not drive the scene, with the reason. \return false: it may
bool SceneClients::refused(const LocalListener::Arrival& next) const {
  const std::string why =
      next.refusal.empty() ? foreign_peer(next.client).value_or("") : next.refusal;
  if (why.empty())
    return false;
  say(next.client, why);
  if (options_.warn)
    options_.warn(why);
  return true;
}

/// One line that fits into any buffer, for a client that is refused.
void SceneClients::say(const formats::Descriptor& to, const std::string& text) const {
  std::string line = formats::text_error(0, text);
  if (options_.binary)
    line = formats::binary_error(0, line);
  (void)send_some(to, line);
}

bool SceneClients::hung_up() const {
  pollfd client{client_.get(), POLLRDHUP, 0};
  return ::poll(&client, 1, 0) > 0;
}

void SceneClients::drop(const std::string& why) {
  client_ = formats::Descriptor();
  unread_.clear();
  leaving_ = false;
  if (!why.empty() && options_.warn)
    options_.warn("client " + std::to_string(clients_) + " " + why + ", it is dropped");
}

/// Until at most so many bytes wait to be read, or the client is dropped.
void SceneClients::flush(std::size_t most) {
  double left = options_.patience;
  while (client_ && !unread_.empty()) {
    const Transfer sent = send_some(client_, unread_);
    if (sent == Transfer::over)
      return drop("");
    if (unread_.size() <= most)
      return;
    if (sent == Transfer::some)
      left = options_.patience;
    if (!(left > 0))
      return drop("read nothing for " + text::number_text(options_.patience) +
                  " s while answers waited");
    std::array<pollfd, 2> who{pollfd{client_.get(), POLLOUT, 0}, others()};
    const auto start = std::chrono::steady_clock::now();
    (void)wait_for(who, left);
    left -= std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    turn_away();
  }
}

void SceneClients::reply(std::string_view bytes) {
  if (!client_)
    return;
  unread_ += bytes;
  flush(options_.most_unread);
  if (client_)
    turn_away();
}

} // namespace gewebe::cli
