// What a scene's names of files stand for.

#include "base/error.h"
#include "contact/convex_core.h"
#include "formats/mesh/ply.h"
#include "formats/model/ela.h"
#include "formats/store/stiffness_store.h"
#include "formats/stream/kind.h"
#include "repair/weld.h"
#include "tools/cli/space_option.h"
#include "tools/run/scene_run.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <functional>
#include <istream>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>

namespace gewebe::cli {

namespace {

constexpr std::size_t longest_list = 1U << 26U;    // of node numbers: some six millions
constexpr std::uint64_t longest_piped = 1U << 30U; // model: some two million nodes

/// A file or a pipe that is there: a device has no known end.
struct stat facts_of(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || ::access(path.c_str(), R_OK) != 0)
    throw Error(path, std::string("cannot open: ") + std::strerror(errno));
  if (S_ISDIR(info.st_mode))
    throw Error(path, "is a directory, expected a file");
  if (S_ISCHR(info.st_mode) || S_ISBLK(info.st_mode))
    throw Error(path, "is a device, expected a file or a pipe");
  return info;
}

/// Not longer than a list may be, for a device has no end.
std::string list_text(formats::Input input) {
  (void)input.peek(1); // something must be there
  std::string text;
  for (std::vector<char> chunk(65536); input.stream();) {
    input.stream().read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    text.append(chunk.data(), static_cast<std::size_t>(input.stream().gcount()));
    if (text.size() > longest_list)
      throw Error(input.name(), "is longer than 64 MiB, expected a list of node numbers");
  }
  if (input.stream().bad())
    throw Error(input.name(), "cannot be read to its end");
  return text;
}

/// Warns of the first model whose space is not that of the models before it.
class SpaceCheck {
public:
  explicit SpaceCheck(std::function<void(const std::string&)> warn) : warn_(std::move(warn)) {}
  void add(const std::string& name, Space space) {
    const std::lock_guard lock(mutex_);
    if (warned_ || !warn_)
      return;
    warned_ = spaces_differ(first_, space);
    if (warned_)
      warn_(two_spaces_text(first_name_, first_, name, space));
    if (first_ == Space::unknown) {
      first_ = space;
      first_name_ = name;
    }
  }

private:
  std::mutex mutex_;
  std::function<void(const std::string&)> warn_;
  Space first_ = Space::unknown;
  std::string first_name_;
  bool warned_ = false;
};

} // namespace

std::string scene_file_path(const std::string& scene, const std::string& name) {
  const std::size_t slash = scene.find_last_of('/');
  const std::string folder =
      scene == "-" || slash == std::string::npos ? "" : scene.substr(0, slash + 1);
  if (name == "-")
    return folder + "./-"; // a file, for the pipe may be the scene's
  return name.starts_with('/') ? name : folder + name;
}

SceneFiles scene_files(const std::string& scene, const Context& context,
                       const std::function<void(const std::string&)>& warn) {
  const auto resolve = [scene](const std::string& name) { return scene_file_path(scene, name); };
  SceneFiles files;
  files.check = [resolve](const std::string& name) { (void)facts_of(resolve(name)); };
  const auto spaces = std::make_shared<SpaceCheck>(warn);
  files.model = [resolve, context, spaces](const std::string& name) {
    const std::string path = resolve(name);
    Context reading = context;
    if (!S_ISREG(facts_of(path).st_mode)) // it may have no end, and memory has one
      reading.max_memory = std::min(reading.max_memory, longest_piped);
    formats::Input input(path, false);
    Space space = Space::unknown;
    model::Model model = formats::read_ela(input, reading, &space);
    spaces->add(input.name(), space);
    return model;
  };
  files.store = [resolve](const std::string& name, const model::Model& model) {
    const auto store = std::make_shared<formats::StiffnessStore>(resolve(name));
    const formats::StiffnessFacts facts = store->facts(model);
    return compliance::StoredStiffness{store->columns(facts),
                                       [store, facts] { return store->factor(facts); }};
  };
  files.second_stage = [resolve](const std::string& name, const model::Model& model) {
    const auto store = std::make_shared<formats::StiffnessStore>(resolve(name));
    const std::optional<formats::StiffnessFacts> facts = store->second_stage(store->facts(model));
    if (!facts)
      throw Error(resolve(name), "no second stage of this object, expected one, "
                                 "see --stage of ffe-precompute(1)");
    return [store, facts] {
      return compliance::compliance_of_store(
          {store->columns(*facts), [store, facts] { return store->factor(*facts); }});
    };
  };
  files.node_list = [resolve](const std::string& name) {
    const std::string path = resolve(name);
    if (!S_ISREG(facts_of(path).st_mode)) // a pipe without a writer would block
      throw Error(path, "is no regular file, expected one");
    return list_text(formats::Input(path, false));
  };
  files.instrument = [resolve, context](const std::string& name, contact::InstrumentShape shape) {
    const std::string path = resolve(name);
    (void)facts_of(path);
    formats::Input input(path, true);
    // The readers of other formats would have to be loaded with this program, at every start.
    if (formats::input_kind(input.peek(4096), path, "") != formats::Kind::ply)
      throw Error(path, "is no PLY file, expected one, as exp2ela --to ply makes of any mesh");
    TriangleMesh mesh =
        at(path, [&] { return formats::read_ply(input.read_all(context.max_memory), path); });
    repair::weld(mesh, {.mode = repair::Weld::all, .drop_unused = true});
    shape.core = at(path, [&] { return std::make_shared<const contact::ConvexCore>(mesh); });
    if (!(shape.radius > 0))
      shape.radius = shape.core->size() / 100;
    return shape;
  };
  files.write_model = [resolve, context](const std::string& name, const model::Model& model) {
    formats::Output::Options whole;
    whole.binary = false;
    whole.sync = true;
    whole.beside = true;
    formats::Output output(resolve(name), whole);
    formats::write_ela(output, model, context);
    output.commit();
  };
  return files;
}

} // namespace gewebe::cli
