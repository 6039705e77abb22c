// Any bytes as a scene over two small models: an Error, or a run whose answers are well-formed.

#include "base/error.h"
#include "formats/scene_run.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

namespace {

using namespace gewebe;

/// A tetrahedron, one corner of which is held; with its centre tied to a fixed node beside it.
Model small_model() {
  Model m;
  m.name = "small";
  m.materials.resize(1);
  m.materials[0].name = "m";
  const Vec3 places[]{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const Vec3& p : places) {
    Node n;
    n.position = p;
    n.mass = 1;
    n.drag = 0.1;
    m.nodes.push_back(n);
  }
  for (std::size_t i = 0; i < 3; ++i)
    m.nodes[i].fixed = i == 0 ? fixed_all : fixed_z;
  for (std::uint32_t i = 0; i < 4; ++i)
    for (std::uint32_t j = i + 1; j < 4; ++j)
      m.springs.push_back(
          {i, j, SpringKind::edge, 10, 0.1, norm(m.nodes[j].position - m.nodes[i].position)});
  m.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return m;
}

struct Stop {};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::size_t answers = 0, objects = 0;
  SceneOptions options;
  options.files.model = [&](const std::string&) {
    if (++objects > 4)
      throw Stop{};
    return small_model();
  };
  options.files.store = [](const std::string& name, const Model&) -> StiffnessParts {
    throw Error(name, "no store here");
  };
  options.files.node_list = [](const std::string&) { return std::string("1 3"); };
  options.reply = [&](std::string_view text) {
    if (!text.starts_with("step ") || !text.ends_with("\ndone\n"))
      std::abort();
    if (++answers > 20) // a long run is no fault
      throw Stop{};
  };
  options.measure = true;
  Context context;
  context.threads = 1;
  std::size_t asked = 0;
  context.cancelled = [&] {
    if (++asked > 2000)
      throw Stop{};
    return false;
  };
  SceneRun run("fuzz", context, options);
  std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    while (!text.empty()) {
      const std::size_t end = text.find('\n');
      run.line(text.substr(0, end));
      text = end == std::string_view::npos ? "" : text.substr(end + 1);
    }
    run.finish();
  } catch (const Error& error) { // what bad input is for
    if (!error.place().starts_with("fuzz"))
      std::abort();
  } catch (const Stop&) {
  }
  return 0;
}
