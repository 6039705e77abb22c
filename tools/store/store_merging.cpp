#include "tools/store/store_merging.h"

#include "base/error.h"
#include "columns/column_compression.h"
#include "columns/columns.h"
#include "tools/store/store_making.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

namespace gewebe::cli {

namespace {

columns::CompressedMade chunks_of(const columns::CompressedColumns& columns) {
  columns::CompressedMade made{columns.layout(), {}, 0};
  for (std::size_t k = 0; k < made.layout.with_columns; ++k)
    made.chunks.push_back(columns.chunk_bytes(k));
  return made;
}

/// One object of one or several stores; each holds some columns.
void join_object(const std::vector<const formats::StiffnessStore*>& stores,
                 const std::string& group, formats::StiffnessStoreWriter& writer,
                 StoreTotals& totals) {
  std::vector<formats::StiffnessFacts> facts;
  std::vector<std::unique_ptr<columns::ColumnSource>> sources;
  std::vector<std::uint32_t> nodes;
  std::optional<linalg::StiffnessMatrix> matrix;
  std::optional<linalg::Factor> factor;
  for (const formats::StiffnessStore* const store : stores) {
    const formats::StiffnessFacts f = store->facts(group);
    linalg::StiffnessMatrix k = store->matrix(f);
    linalg::Factor l = store->factor(f);
    const auto same = [&](const formats::StiffnessFacts& g) {
      return f.hash == g.hash && f.single == g.single && f.compressed == g.compressed &&
             f.row_nodes == g.row_nodes && f.method == g.method && f.norm == g.norm &&
             f.condition == g.condition && k.value == matrix->value &&
             std::ranges::equal(l.view().x, factor->view().x);
    };
    if (!facts.empty() && !same(facts.front()))
      throw Error(store->path(), "'" + f.object + "' is of another model than in " +
                                     stores.front()->path() +
                                     " or was made with other options, expected the same");
    facts.push_back(f);
    if (!matrix) {
      matrix = std::move(k);
      factor = std::move(l);
    }
    sources.push_back(store->columns(f));
    if (sources.back() == nullptr)
      continue;
    const std::vector<std::uint32_t>& more = sources.back()->nodes();
    if (!nodes.empty() && !more.empty() && more.front() <= nodes.back())
      throw Error(store->path(), "'" + f.object + "' has columns of node " +
                                     std::to_string(more.front()) +
                                     " that another part has, too, expected others");
    nodes.insert(nodes.end(), more.begin(), more.end());
  }
  double residual = 0;
  for (const formats::StiffnessFacts& f : facts)
    residual = std::max(residual, f.residual);
  const std::vector<std::uint32_t> missing = writer.begin(facts.front(), *matrix, *factor, nodes);
  if (facts.front().compressed > 0) {
    if (stores.size() > 1)
      throw Error(stores.front()->path(),
                  "'" + facts.front().object + "' has compressed columns, expected plain ones");
    writer.write_compressed(chunks_of(*sources.front()->compressed()));
    add(totals, facts.front(), *matrix, *factor, nodes.size(), writer.end(residual));
    return;
  }
  std::vector<double> columns(9 * formats::rows_of(facts.front()));
  std::size_t k = 0; // of the missing
  for (const auto& source : sources)
    for (std::size_t i = 0; source != nullptr && i < source->nodes().size(); ++i)
      if (k < missing.size() && missing[k] == source->nodes()[i]) {
        source->read(i, columns);
        writer.write(k++, columns, residual);
      }
  residual = writer.end(residual);
  add(totals, facts.front(), *matrix, *factor, nodes.size(), residual);
}

} // namespace

void copy_object(const formats::StiffnessStore& store, const std::string& group,
                 formats::StiffnessStoreWriter& writer, StoreTotals& totals) {
  join_object({&store}, group, writer, totals);
}

void copy_store(const formats::StiffnessStore& store, formats::StiffnessStoreWriter& writer,
                StoreTotals& totals) {
  for (const std::string& group : store.objects())
    copy_object(store, group, writer, totals);
}

void merge_stores(const std::vector<std::string>& paths, formats::StiffnessStoreWriter& writer,
                  StoreTotals& totals) {
  std::vector<formats::StiffnessStore> stores;
  stores.reserve(paths.size());
  for (const std::string& path : paths)
    stores.emplace_back(path);
  std::ranges::stable_sort(stores, {},
                           [](const formats::StiffnessStore& s) { return s.shard().index; });
  std::vector<std::string> groups;
  for (std::size_t i = 0; i < stores.size(); ++i) {
    const auto [index, count] = stores[i].shard();
    const std::uint64_t expected = stores.front().shard().count;
    if (count != expected || index != i + 1)
      throw Error(stores[i].path(), "is part " + std::to_string(index) + " of " +
                                        std::to_string(count) + ", expected part " +
                                        std::to_string(i + 1) + " of " + std::to_string(expected));
    for (const std::string& group : stores[i].objects()) {
      if (stores[i].second_stage(stores[i].facts(group)))
        throw Error(stores[i].path(),
                    "'" + group + "' has a second stage, expected --stage 2 after --merge");
      groups.push_back(group);
    }
  }
  if (stores.size() != stores.front().shard().count)
    throw Error(stores.back().path(), "is the last of " + std::to_string(stores.size()) +
                                          " parts, expected all " +
                                          std::to_string(stores.front().shard().count));
  std::ranges::sort(groups);
  groups.erase(std::ranges::unique(groups).begin(), groups.end());
  for (const std::string& group : groups) {
    std::vector<const formats::StiffnessStore*> holders;
    for (const formats::StiffnessStore& store : stores) {
      const std::vector<std::string> names = store.objects();
      if (std::ranges::find(names, group) != names.end())
        holders.push_back(&store);
    }
    join_object(holders, group, writer, totals);
  }
}

} // namespace gewebe::cli
