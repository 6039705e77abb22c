#include "tools/serve/scene_answers.h"

#include "tools/serve/scene_lines.h"

#include <ostream>
#include <utility>

namespace gewebe::cli {

SceneAnswers::SceneAnswers(bool spoken, bool binary, const std::string& listen,
                           SceneClientsOptions options)
    : awake_(options.awake) {
  options.binary = binary;
  if (!listen.empty())
    clients_.emplace(listen, std::move(options));
  if (spoken)
    spoken_.emplace("-", formats::Output::Options{.binary = binary});
}

void SceneAnswers::run(formats::Input* input, SceneRun& scene) {
  if (input != nullptr)
    run_lines(*input, scene, awake_);
  if (clients_)
    clients_->serve(scene);
  clients_.reset(); // no more clients
}

void SceneAnswers::write(std::string_view bytes) {
  if (clients_ && clients_->serving())
    return clients_->reply(bytes);
  if (!spoken_)
    return;
  spoken_->write(bytes);
  spoken_->stream().flush(); // at once: the client waits for it
}

void SceneAnswers::commit() {
  if (spoken_)
    spoken_->commit();
}

} // namespace gewebe::cli
