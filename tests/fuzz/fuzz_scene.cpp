// Any bytes as a scene over small models: an Error, or a run whose answers are well-formed. Served,
// each line ends with its acknowledgement or its error, one that is refused takes no time; in
// binary the frames follow one another.

#include "base/error.h"
#include "formats/scene/frames_binary.h"
#include "model/model.h"
#include "tools/run/scene_run.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

namespace {

using namespace gewebe;

/// A tetrahedron, one corner of which is held; with its centre tied to a fixed node beside it.
model::Model small_model() {
  model::Model m;
  m.name = "small";
  m.materials.resize(1);
  m.materials[0].name = "m";
  const Vec3 places[]{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const Vec3& p : places) {
    model::Node n;
    n.position = p;
    n.mass = 1;
    n.drag = 0.1;
    m.nodes.push_back(n);
  }
  for (std::size_t i = 0; i < 3; ++i)
    m.nodes[i].fixed = i == 0 ? model::fixed_all : model::fixed_z;
  for (std::uint32_t i = 0; i < 4; ++i)
    for (std::uint32_t j = i + 1; j < 4; ++j)
      m.springs.push_back({i, j, model::SpringKind::edge, 10, 0.1,
                           norm(m.nodes[j].position - m.nodes[i].position)});
  m.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return m;
}

struct Stop {};

/// Whether the bytes are whole frames, of which the last is `kind`.
bool are_frames(std::string_view bytes, formats::FrameKind kind) {
  std::uint32_t last = UINT32_MAX;
  while (!bytes.empty()) {
    std::uint32_t magic = 0;
    std::uint64_t count = 0;
    if (bytes.size() < 28)
      return false;
    std::memcpy(&magic, bytes.data(), 4);
    std::memcpy(&last, bytes.data() + 4, 4);
    std::memcpy(&count, bytes.data() + 20, 8);
    if (magic != formats::frame_magic || count > (bytes.size() - 28) / 4)
      return false;
    bytes.remove_prefix(28 + 4 * count);
  }
  return last == static_cast<std::uint32_t>(kind);
}

enum class Reply { none, refusal, ok, step, told };

Reply binary_reply(std::string_view frames) {
  for (const auto& [kind, reply] : {std::pair{formats::FrameKind::error, Reply::refusal},
                                    {formats::FrameKind::ok, Reply::ok},
                                    {formats::FrameKind::done, Reply::step},
                                    {formats::FrameKind::told, Reply::told}})
    if (are_frames(frames, kind))
      return reply;
  return Reply::none;
}

Reply text_reply(std::string_view text) {
  if (text.empty() || text.back() != '\n')
    return Reply::none;
  const bool single = text.find('\n') == text.size() - 1;
  if (text.starts_with("step "))
    return text.ends_with("\ndone\n") ? Reply::step : Reply::none;
  for (const char* word : {"nodes ", "select ", "objects ", "instruments "})
    if (text.starts_with(word))
      return Reply::told;
  return !single                      ? Reply::none
         : text.starts_with("error ") ? Reply::refusal
         : text.starts_with("ok ")    ? Reply::ok
         : text.starts_with("sync ")  ? Reply::told
                                      : Reply::none;
}

void play(std::string_view text, bool serving, bool binary) {
  std::size_t answers = 0, objects = 0, refusals = 0, ended = 0;
  cli::SceneOptions options;
  options.files.model = [&](const std::string&) {
    if (++objects > 4)
      throw Stop{};
    return small_model();
  };
  options.files.store = [](const std::string& name,
                           const model::Model&) -> compliance::StoredStiffness {
    throw Error(name, "no store here");
  };
  options.files.node_list = [](const std::string&) { return std::string("1 3"); };
  options.reply = [&](std::string_view bytes) {
    const Reply reply = binary ? binary_reply(bytes) : text_reply(bytes);
    if (reply == Reply::none || ended > 0) // nothing is said behind the end of a line
      std::abort();
    refusals += reply == Reply::refusal ? 1 : 0;
    ended += reply == Reply::refusal || reply == Reply::ok ? 1 : 0;
    if (reply == Reply::step && ++answers > 20) // a long run is no fault
      throw Stop{};
  };
  options.serve = options.acknowledge = serving;
  options.binary = binary;
  options.measure = true;
  options.measure_error = true;
  Context context;
  context.threads = 1;
  std::size_t asked = 0;
  context.cancelled = [&] {
    if (++asked > 2000)
      throw Stop{};
    return false;
  };
  cli::SceneRun run("fuzz", context, options);
  try {
    while (!text.empty() && !run.ended()) {
      const std::size_t end = text.find('\n');
      const std::string_view line = text.substr(0, end);
      const double time = run.simulation().time();
      const std::size_t refused = refusals, answered = answers,
                        pending = run.simulation().pending();
      ended = 0;
      run.line(line);
      if (refusals > refused + 1 || (refusals > 0 && !serving) || ended != (serving ? 1U : 0U))
        std::abort();
      if (refusals > refused && answers == answered &&
          (run.simulation().time() != time || run.simulation().pending() != pending))
        std::abort();
      text = end == std::string_view::npos ? "" : text.substr(end + 1);
    }
    run.finish();
  } catch (const Error& error) {                       // what bad input is for
    if (!error.place().starts_with("fuzz") && !binary) // there, what does not fit has no place
      std::abort();
  } catch (const Stop&) {
  }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  play(text, false, false);
  play(text, true, false);
  play(text, true, true);
  return 0;
}
