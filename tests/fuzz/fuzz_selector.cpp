// Any text as a selector (its second line as the file that it may name), on a model of two sheets:
// an Error, or nodes that exist, ascending.

#include "base/error.h"
#include "model/build.h"
#include "model/selector.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace {

gewebe::model::Model two_squares() {
  gewebe::TriangleMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                 {5, 0, 0}, {6, 0, 0}, {6, 1, 0}, {5, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  return gewebe::model::build_model(mesh, {}, gewebe::Context{}).model;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const gewebe::model::Model model = two_squares();
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t line_end = std::min(text.find('\n'), text.size());
  try {
    const gewebe::model::Selector selector =
        gewebe::model::parse_selector(text.substr(0, line_end));
    const auto load = [&](const std::string&) { return std::string(text.substr(line_end)); };
    const std::vector<std::uint32_t> nodes = gewebe::model::select_nodes(model, selector, load);
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (nodes[i] >= model.nodes.size() || (i > 0 && nodes[i] <= nodes[i - 1]))
        std::abort();
  } catch (const gewebe::Error&) { // what bad input is for
  }
  return 0;
}
