#include "columns/compressed_columns.h"

#include "base/error.h"
#include "base/parallel.h"
#include "columns/costs.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

namespace gewebe::columns {

namespace {

// More than a block could need: sizes that files tell stay far from overflow.
constexpr std::uint32_t max_crosses = 1U << 16;
constexpr std::size_t max_cluster_nodes = 1U << 12;

/// Blocks of the chunks before.
std::size_t first_block(const CompressedLayout& layout, std::size_t chunk) {
  return chunk * layout.clusters.size() - chunk * (chunk - 1) / 2;
}

CrossView shape_of(const CompressedLayout& layout, std::size_t chunk, std::size_t cluster) {
  CrossView view;
  view.rows = 3 * layout.clusters.nodes(chunk).size();
  view.columns = 3 * layout.clusters.nodes(cluster).size();
  view.symmetric = chunk == cluster;
  view.count = layout.count[first_block(layout, chunk) + cluster - chunk];
  return view;
}

/// Numbers of a chunk by kind.
struct ChunkNumbers {
  std::uint64_t scales = 0, wide = 0, narrow = 0;

  std::uint64_t bytes() const { return 8 * scales + 2 * wide + narrow; }
  void add(const CrossView& view) {
    scales += std::uint64_t{view.count.wide} + view.count.narrow;
    wide += std::uint64_t{view.count.wide} * view.stride();
    narrow += std::uint64_t{view.count.narrow} * view.stride();
  }
};

ChunkNumbers numbers_of(const CompressedLayout& layout, std::size_t chunk) {
  ChunkNumbers numbers;
  for (std::size_t b = chunk; b < layout.clusters.size(); ++b)
    numbers.add(shape_of(layout, chunk, b));
  return numbers;
}

template <class T>
std::vector<T> take(const std::vector<std::uint8_t>& bytes, std::uint64_t& at,
                    std::uint64_t count) {
  std::vector<T> values(count);
  if (count > 0)
    std::memcpy(values.data(), bytes.data() + at, count * sizeof(T));
  at += count * sizeof(T);
  return values;
}

} // namespace

void check_layout(const CompressedLayout& layout, std::size_t row_nodes) {
  const auto require = [](bool good, const char* what) {
    if (!good)
      throw Error(std::string("compressed columns contradict themselves: ") + what);
  };
  const NodeClusters& clusters = layout.clusters;
  require(clusters.node.size() == row_nodes, "their nodes");
  require(!clusters.first.empty() && clusters.first.front() == 0 &&
              clusters.first.back() == row_nodes &&
              std::is_sorted(clusters.first.begin(), clusters.first.end()),
          "their clusters");
  for (std::size_t a = 0; a < clusters.size(); ++a)
    require(clusters.nodes(a).size() <= max_cluster_nodes, "their clusters");
  std::vector<bool> seen(row_nodes);
  for (const std::uint32_t node : clusters.node) {
    require(node < row_nodes && !seen[node], "their nodes");
    seen[node] = true;
  }
  require(layout.with_columns <= clusters.size(), "their clusters");
  require(layout.count.size() == first_block(layout, layout.with_columns), "their blocks");
  for (const CrossCount& count : layout.count)
    require(count.wide <= max_crosses && count.narrow <= max_crosses, "their blocks");
  require(std::isfinite(layout.bound) && layout.bound > 0, "their bound");
  require(std::isfinite(layout.relative) && layout.relative > 0, "their bound");
}

std::vector<std::uint64_t> chunk_sizes(const CompressedLayout& layout) {
  std::vector<std::uint64_t> sizes;
  for (std::size_t a = 0; a < layout.with_columns; ++a)
    sizes.push_back(numbers_of(layout, a).bytes());
  return sizes;
}

std::vector<std::uint8_t> bytes_of(const Crosses& chunk) {
  std::vector<std::uint8_t> bytes;
  const auto append = [&](const auto& values) {
    const std::size_t at = bytes.size(), size = values.size() * sizeof(values[0]);
    bytes.resize(at + size);
    if (size > 0)
      std::memcpy(bytes.data() + at, values.data(), size);
  };
  append(chunk.scale);
  append(chunk.wide);
  append(chunk.narrow);
  return bytes;
}

CompressedColumns::CompressedColumns(CompressedLayout layout, std::size_t nodes, ChunkReader reader)
    : layout_(std::move(layout)), node_count_(nodes), reader_(std::move(reader)),
      place_(layout_.clusters.node.size()), at_(layout_.count.size()),
      row_numbers_(layout_.with_columns), chunks_(layout_.with_columns),
      largest_(layout_.count.size()) {
  cluster_.resize(place_.size());
  for (std::size_t a = 0; a < layout_.clusters.size(); ++a) {
    const auto members = layout_.clusters.nodes(a);
    for (std::size_t k = 0; k < members.size(); ++k) {
      cluster_[members[k]] = static_cast<std::uint32_t>(a);
      place_[members[k]] = static_cast<std::uint32_t>(k);
    }
    if (a < layout_.with_columns)
      nodes_.insert(nodes_.end(), members.begin(), members.end());
  }
  std::sort(nodes_.begin(), nodes_.end());
  for (std::size_t a = 0; a < layout_.with_columns; ++a) {
    ChunkNumbers before;
    for (std::size_t b = a; b < layout_.clusters.size(); ++b) {
      const CrossView shape = shape_of(layout_, a, b);
      at_[first_block(layout_, a) + b - a] = {before.scales, before.wide, before.narrow};
      ChunkNumbers own;
      own.add(shape);
      before.add(shape);
      row_numbers_[a] += static_cast<double>(own.wide + own.narrow);
      if (a < b && b < layout_.with_columns)
        row_numbers_[b] += static_cast<double>(own.wide + own.narrow);
    }
  }
}

const Crosses& CompressedColumns::chunk(std::size_t index) const {
  std::optional<Crosses>& kept = chunks_[index];
  if (kept)
    return *kept;
  const ChunkNumbers numbers = numbers_of(layout_, index);
  const std::vector<std::uint8_t> bytes = reader_(index);
  if (bytes.size() != numbers.bytes())
    throw Error("compressed columns have a chunk of " + std::to_string(bytes.size()) +
                " bytes, expected " + std::to_string(numbers.bytes()));
  Crosses made;
  std::uint64_t at = 0;
  made.scale = take<double>(bytes, at, numbers.scales);
  made.wide = take<std::int16_t>(bytes, at, numbers.wide);
  made.narrow = take<std::int8_t>(bytes, at, numbers.narrow);
  for (const double scale : made.scale)
    if (!std::isfinite(scale))
      throw Error("compressed columns have a scale that is not finite");
  ++chunks_read_;
  kept.emplace(std::move(made));
  return *kept;
}

void CompressedColumns::read_all() const {
  for (std::size_t a = 0; a < layout_.with_columns; ++a)
    (void)chunk(a);
}

CrossView CompressedColumns::view(std::size_t chunk_index, std::size_t cluster) const {
  const Crosses& from = chunk(chunk_index);
  CrossView view = shape_of(layout_, chunk_index, cluster);
  const BlockPlace& at = at_[first_block(layout_, chunk_index) + cluster - chunk_index];
  view.scale = from.scale.data() + at.scale;
  view.wide = from.wide.data() + at.wide;
  view.narrow = from.narrow.data() + at.narrow;
  return view;
}

std::array<std::array<double, 3>, 3> CompressedColumns::block(std::uint32_t node,
                                                              std::uint32_t other) const {
  const bool turned = is_before(other, node);
  const std::uint32_t first = turned ? other : node, second = turned ? node : other;
  std::array<double, 9> sum{};
  add_entries(view(of(first), of(second)), 3 * std::size_t{place_[first]},
              3 * std::size_t{place_[second]}, 3, sum.data());
  std::array<std::array<double, 3>, 3> block{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      block[r][c] = turned ? sum[3 * c + r] : sum[3 * r + c];
  return block;
}

double CompressedColumns::entry(std::uint32_t node, int axis, std::size_t row) const {
  const auto other = static_cast<std::uint32_t>(row / 3);
  const std::size_t own = 3 * std::size_t{place_[node]} + static_cast<std::size_t>(axis);
  const std::size_t its = 3 * std::size_t{place_[other]} + row % 3;
  const bool turned = is_before(other, node);
  const std::uint32_t first = turned ? other : node, second = turned ? node : other;
  double sum = 0;
  add_entries(view(of(first), of(second)), turned ? its : own, turned ? own : its, 1, &sum);
  return sum;
}

void CompressedColumns::add(std::span<const contact::NodeVector> forces, const Context& context,
                            std::span<double> u) const {
  const std::vector<ClusterLoad> loads = loads_of(forces);
  double work = 0;
  for (const ClusterLoad& own : loads)
    work += row_numbers_[own.cluster];
  Context some = context;
  some.progress = nullptr;
  if (!(work >= static_cast<double>(costs::worth_threads)))
    some.threads = 1;
  parallel_blocks(some, layout_.clusters.size(), 1, [&](std::size_t b, std::size_t) {
    const std::vector<double> sum = sum_at(b, loads, some.cpu);
    const auto members = layout_.clusters.nodes(b);
    for (std::size_t k = 0; k < members.size(); ++k) {
      double* const to = u.data() + 3 * std::size_t{members[k]};
      const double* const more = sum.data() + 3 * k;
      to[0] += more[0];
      to[1] += more[1];
      to[2] += more[2];
    }
  });
}

std::vector<ClusterLoad>
CompressedColumns::loads_of(std::span<const contact::NodeVector> forces) const {
  std::map<std::size_t, std::vector<CrossLoad>> loads; // by cluster
  for (const contact::NodeVector& f : forces)
    for (int a = 0; a < 3; ++a)
      if (f.value[a] != 0)
        loads[of(f.node)].push_back(
            {3 * std::size_t{place_[f.node]} + static_cast<std::size_t>(a), f.value[a]});
  std::vector<ClusterLoad> all;
  for (auto& [cluster, load] : loads) {
    all.push_back({cluster, std::move(load)});
    for (std::size_t a = 0; a <= cluster; ++a)
      (void)chunk(a); // none is loaded by sums, where threads read them
  }
  return all;
}

std::vector<double> CompressedColumns::sum_at(std::size_t cluster,
                                              std::span<const ClusterLoad> loads,
                                              CpuLevel cpu) const {
  std::vector<double> sum(3 * layout_.clusters.nodes(cluster).size());
  for (const auto& [a, load] : loads)
    add_product(view(std::min(a, cluster), std::max(a, cluster)), a < cluster, load, cpu, sum);
  return sum;
}

std::vector<double> CompressedColumns::sum_at(std::span<const std::uint32_t> clusters,
                                              std::span<const contact::NodeVector> forces,
                                              const Context& context) const {
  const std::vector<ClusterLoad> loads = loads_of(forces);
  std::vector<double> all;
  for (const std::uint32_t cluster : clusters) {
    const std::vector<double> sum = sum_at(cluster, loads, context.cpu);
    all.insert(all.end(), sum.begin(), sum.end());
  }
  return all;
}

std::span<const std::array<double, 2>> CompressedColumns::largest(std::size_t chunk_index,
                                                                  std::size_t cluster) const {
  std::vector<std::array<double, 2>>& kept =
      largest_[first_block(layout_, chunk_index) + cluster - chunk_index];
  if (kept.empty())
    kept = largest_entries(view(chunk_index, cluster));
  return kept;
}

std::vector<double> CompressedColumns::bounds(std::span<const contact::NodeVector> forces,
                                              const Context& context) const {
  const std::vector<ClusterLoad> loads = loads_of(forces);
  std::vector<double> bound(layout_.clusters.size());
  for (std::size_t b = 0; b < bound.size(); ++b)
    for (const auto& [a, load] : loads) {
      if (a == b) {
        std::vector<double> sum(3 * layout_.clusters.nodes(b).size());
        add_product(view(a, a), false, load, context.cpu, sum);
        double most = 0;
        for (const double u : sum)
          most = std::max(most, std::abs(u));
        bound[b] += most;
      } else {
        const std::size_t first = std::min(a, b), second = std::max(a, b);
        bound[b] += product_bound(view(first, second), a < b, load, largest(first, second));
      }
    }
  return bound;
}

void CompressedColumns::read(std::size_t k, std::span<double> out) const {
  std::fill(out.begin(), out.end(), 0.0);
  Context alone;
  alone.threads = 1;
  const std::size_t axes = out.size() / 3;
  for (int a = 0; a < 3; ++a) {
    contact::NodeVector unit{nodes_[k], {}};
    unit.value[a] = 1;
    add({&unit, 1}, alone, out.subspan(static_cast<std::size_t>(a) * axes, axes));
  }
}

double CompressedColumns::numbers(std::span<const std::uint32_t> nodes) const {
  std::vector<std::uint32_t> touched;
  for (const std::uint32_t node : nodes)
    touched.push_back(of(node));
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  double sum = 0;
  for (const std::uint32_t cluster : touched)
    sum += row_numbers_[cluster];
  return sum;
}

} // namespace gewebe::columns
