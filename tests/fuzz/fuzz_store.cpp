// Any bytes as a stiffness store: an Error or arrays that can be used, never a crash.

#include "base/error.h"
#include "columns/compressed_columns.h"
#include "formats/store/stiffness_store.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

void use(const gewebe::formats::StiffnessStore& store,
         const gewebe::formats::StiffnessFacts& facts) {
  const gewebe::linalg::StiffnessMatrix matrix = store.matrix(facts);
  const gewebe::linalg::Factor factor = store.factor(facts);
  std::vector<double> f(3 * facts.nodes, 1.0), u(f.size());
  gewebe::linalg::solve_axes(matrix, factor, f, u);
  if (const auto columns = store.columns(facts)) {
    std::vector<double> row(9 * columns->node_count());
    for (std::size_t k = 0; k < columns->nodes().size(); ++k)
      columns->read(k, row);
    if (const auto* const compressed = columns->compressed())
      for (const std::uint32_t node : columns->nodes())
        (void)compressed->block(node, 0);
  }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const gewebe::formats::StiffnessStore store(std::span(data, size), "fuzz");
    for (const std::string& name : store.objects())
      use(store, store.facts(name));
  } catch (const gewebe::Error&) { // what bad input is for
  }
  return 0;
}
