// What a scene's names of files stand for.

#include "base/error.h"
#include "formats/ela.h"
#include "formats/scene_run.h"
#include "formats/stiffness_store.h"

#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>
#include <sys/stat.h>
#include <unistd.h>

namespace gewebe {

SceneFiles scene_files(const std::string& scene, const Context& context) {
  const std::size_t slash = scene.find_last_of('/');
  const std::string folder =
      scene == "-" || slash == std::string::npos ? "" : scene.substr(0, slash + 1);
  const auto resolve = [folder](const std::string& name) {
    if (name == "-")
      return folder + "./-"; // a file, for the pipe may be the scene's
    return name.starts_with('/') ? name : folder + name;
  };
  SceneFiles files;
  files.check = [resolve](const std::string& name) {
    const std::string path = resolve(name);
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0 || ::access(path.c_str(), R_OK) != 0)
      throw Error(path, std::string("cannot open: ") + std::strerror(errno));
    if (S_ISDIR(info.st_mode))
      throw Error(path, "is a directory, expected a file");
  };
  files.model = [resolve, context](const std::string& name) {
    Input input(resolve(name), false);
    return read_ela(input, context);
  };
  files.store = [resolve](const std::string& name, const Model& model) {
    const auto store = std::make_shared<StiffnessStore>(resolve(name));
    const StiffnessFacts facts = store->facts(model);
    StiffnessParts parts;
    parts.columns = store->columns(facts);
    parts.factor = [store, facts] { return store->factor(facts); };
    return parts;
  };
  files.second_stage = [resolve](const std::string& name, const Model& model) {
    const auto store = std::make_shared<StiffnessStore>(resolve(name));
    const std::optional<StiffnessFacts> facts = store->second_stage(store->facts(model));
    if (!facts)
      throw Error(resolve(name), "no second stage of this object, expected one, "
                                 "see --stage of ffe-precompute(1)");
    return [store, facts] {
      StiffnessParts parts;
      parts.columns = store->columns(*facts);
      parts.factor = [store, facts] { return store->factor(*facts); };
      return parts;
    };
  };
  files.node_list = [resolve](const std::string& name) {
    return Input(resolve(name), false).read_all();
  };
  files.write_model = [resolve, context](const std::string& name, const Model& model) {
    Output::Options whole;
    whole.binary = false;
    whole.sync = true;
    Output output(resolve(name), whole);
    write_ela(output, model, context);
    output.commit();
  };
  return files;
}

} // namespace gewebe
