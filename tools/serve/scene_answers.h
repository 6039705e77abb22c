#pragma once
// Where answers go: standard output, or the client that a line came from.

#include "formats/stream/stream.h"
#include "tools/serve/scene_clients.h"

#include <optional>
#include <string>
#include <string_view>

namespace gewebe::cli {

class SceneAnswers {
public:
  /// \param spoken whether standard output has them \param listen where clients connect; none: ""
  /// \throw Error, UsageError as Output and SceneClients
  SceneAnswers(bool spoken, bool binary, const std::string& listen, SceneClientsOptions options);

  /// Feeds the run: the lines of `input`, if there is one, then those of clients until one ends it.
  /// \throw Error as run_lines and SceneClients
  void run(formats::Input* input, SceneRun& scene);

  bool any() const noexcept { return spoken_ || clients_; }
  /// Whether the client has disconnected.
  bool unheard() const noexcept { return clients_ && clients_->gone(); }
  void write(std::string_view bytes);
  /// \throw Error
  void commit();

private:
  bool awake_;
  std::optional<SceneClients> clients_;
  std::optional<formats::Output> spoken_;
};

} // namespace gewebe::cli
