#include "formats/store/stiffness_store.h"

#include "base/crc32c.h"
#include "base/digest.h"
#include "base/error.h"
#include "columns/compressed_columns.h"
#include "formats/store/hdf5_internal.h"
#include "formats/store/stiffness_store_internal.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace gewebe::formats {

namespace {

/// A list of `count` numbers whose checksum holds.
template <class T>
std::vector<T> read_checked(const hdf5::Group& group, const std::string& name,
                            std::uint64_t count) {
  const hdf5::Dataset from = group.dataset(name, hdf5::number_of<T>());
  from.require_shape({count});
  std::vector<T> values(count);
  from.read_rows(0, std::span<T>(values));
  if (from.number<std::uint32_t>("crc32c") != crc32c(values))
    from.fail("is damaged: its checksum does not hold");
  return values;
}

/// The same of a list as long as it is.
template <class T>
std::vector<T> read_checked(const hdf5::Group& group, const std::string& name) {
  const hdf5::Dataset from = group.dataset(name, hdf5::number_of<T>());
  return read_checked<T>(group, name, from.rows());
}

/// Numbers of rows and places, of 32 bits or of 64. \param count how many; nothing: as there are
std::vector<std::int64_t> read_places(const hdf5::Group& group, const std::string& name,
                                      std::optional<std::uint64_t> count = {}) {
  if (!group.holds(name, hdf5::Number::uint32))
    return count ? read_checked<std::int64_t>(group, name, *count)
                 : read_checked<std::int64_t>(group, name);
  const std::vector<std::uint32_t> narrow = count ? read_checked<std::uint32_t>(group, name, *count)
                                                  : read_checked<std::uint32_t>(group, name);
  return {narrow.begin(), narrow.end()};
}

void require(const hdf5::Object& where, bool good, const char* what) {
  if (!good)
    where.fail(std::string("is damaged: ") + what);
}

/// An object's group, or "OBJECT/stage2".
hdf5::Group group_of(const hdf5::Group& root, const std::string& name) {
  const std::size_t slash = name.find('/');
  if (slash == std::string::npos)
    return root.group(name);
  return root.group(name.substr(0, slash)).group(name.substr(slash + 1));
}

StiffnessMethod read_method(const hdf5::Group& group) {
  StiffnessMethod method;
  method.name = group.text("method");
  if (method.name == "direct")
    return method;
  require(group, method.name == "relax" || method.name == "relax-fixed", "its method");
  method.force = group.number<double>("force");
  require(group, std::isfinite(method.force) && method.force >= 0, "its force");
  if (method.name == "relax-fixed") {
    method.steps = group.number<std::uint64_t>("steps");
  } else {
    method.threshold = group.number<double>("velocity_threshold");
    require(group, std::isfinite(method.threshold) && method.threshold > 0, "its threshold");
  }
  return method;
}

StiffnessFacts read_facts(const hdf5::Group& root, const std::string& name) {
  const hdf5::Group group = group_of(root, name);
  StiffnessFacts facts;
  facts.object = group.text("name");
  facts.group = name;
  facts.hash = group.number<std::uint64_t>("hash");
  facts.rest = group.number<std::uint64_t>("rest_hash");
  facts.nodes = group.number<std::uint64_t>("nodes");
  facts.order = group.number<std::uint64_t>("order");
  facts.norm = group.number<double>("norm");
  facts.condition = group.number<double>("condition");
  facts.residual = group.number<double>("residual");
  require(group, facts.nodes > 0 && facts.nodes <= UINT32_MAX, "its number of nodes");
  require(group, facts.order > 0 && facts.order <= 3 * facts.nodes, "its order");
  require(group, std::isfinite(facts.norm) && facts.norm > 0, "its norm");
  require(group, std::isfinite(facts.condition) && facts.condition > 0, "its condition");
  require(group, std::isfinite(facts.residual) && facts.residual >= 0, "its residual");
  if (group.has_attribute("row_nodes")) {
    facts.row_nodes = group.number<std::uint64_t>("row_nodes");
    require(group, facts.row_nodes > 0 && facts.row_nodes < facts.nodes, "its row_nodes");
  }
  const std::string precision = group.text("precision");
  facts.single = precision == "float32";
  require(group, facts.single || precision == "float64", "its precision");
  if (group.has(store::compressed)) {
    require(group, !group.has("columns"), "it has columns of two kinds");
    facts.compressed = group.group(store::compressed).number<double>("relative");
    require(group, std::isfinite(facts.compressed) && facts.compressed > 0, "its bound");
  }
  facts.method = read_method(group);
  return facts;
}

void check_matrix(const hdf5::Group& group, const linalg::StiffnessMatrix& matrix) {
  const auto order = static_cast<std::int64_t>(matrix.order());
  require(group,
          matrix.column_start.front() == 0 &&
              matrix.column_start.back() == static_cast<std::int64_t>(matrix.row.size()),
          "its columns");
  for (std::size_t c = 0; c < matrix.order(); ++c) {
    // Checked in this order, each start is known to be in range before it is used.
    require(group, matrix.column_start[c] < matrix.column_start[c + 1], "its columns");
    require(group, matrix.column_start[c + 1] <= matrix.column_start.back(), "its columns");
    std::int64_t before = static_cast<std::int64_t>(c) - 1;
    for (std::int64_t at = matrix.column_start[c]; at < matrix.column_start[c + 1]; ++at) {
      const std::int64_t row = matrix.row[static_cast<std::size_t>(at)];
      require(group, row > before && row < order, "its rows");
      require(group, before >= static_cast<std::int64_t>(c) || row == static_cast<std::int64_t>(c),
              "its diagonal");
      before = row;
    }
  }
  require(group,
          std::all_of(matrix.value.begin(), matrix.value.end(),
                      [](double value) { return std::isfinite(value); }),
          "its values");
}

} // namespace

std::uint64_t stiffness_hash(const model::Model& model) {
  Digest digest;
  const auto add_values = [&](auto... value) {
    const double values[]{static_cast<double>(value)...};
    digest.add_bytes(values, sizeof values);
  };
  digest.add(static_cast<std::uint64_t>(model.nodes.size()));
  for (const model::Node& n : model.nodes)
    add_values(n.position.x, n.position.y, n.position.z, n.mass, n.fixed);
  digest.add(static_cast<std::uint64_t>(model.springs.size()));
  for (const model::Spring& s : model.springs)
    add_values(s.i, s.j, s.stiffness, s.rest);
  if (!model.tetrahedra.empty()) { // else the hash of springs stays what it was
    digest.add(static_cast<std::uint64_t>(model.tetrahedra.size()));
    digest.add(model.tetrahedra);
    digest.add(static_cast<std::uint64_t>(model.middles.size()));
    digest.add(model.middles);
    for (const std::int32_t number : model.tetrahedron_material) {
      const model::Material& m = model.materials[static_cast<std::size_t>(number)];
      add_values(m.young, m.poisson.value_or(-1), m.density);
    }
  }
  return digest.value();
}

std::uint64_t rest_hash(const model::Model& model) {
  Digest digest;
  for (const model::Node& n : model.nodes) {
    const double values[]{n.position.x, n.position.y, n.position.z, static_cast<double>(n.fixed)};
    digest.add_bytes(values, sizeof values);
  }
  return digest.value();
}

std::string second_stage_group(const std::string& group) {
  return group + "/" + store::second_stage;
}

struct StiffnessStore::State {
  hdf5::File file;

  explicit State(hdf5::File opened) : file(std::move(opened)) {
    const hdf5::Group& root = file.root();
    const std::string expected = std::string(", expected a ") + store::format;
    if (!root.has_attribute("format"))
      throw Error(file.path(), "is an HDF5 file of another kind" + expected);
    if (const std::string format = root.text("format"); format != store::format)
      throw Error(file.path(), "is a " + format + expected);
    if (const auto version = root.number<std::int64_t>("version"); version != store::version)
      throw Error(file.path(), "is of version " + std::to_string(version) + ", expected " +
                                   std::to_string(store::version));
  }
};

StiffnessStore::StiffnessStore(const std::string& path)
    : state_(std::make_shared<State>(hdf5::File::open(path))) {}
StiffnessStore::StiffnessStore(std::span<const std::uint8_t> bytes, const std::string& name)
    : state_(std::make_shared<State>(hdf5::File::open_image(bytes, name))) {}
StiffnessStore::~StiffnessStore() = default;
StiffnessStore::StiffnessStore(StiffnessStore&&) noexcept = default;
StiffnessStore& StiffnessStore::operator=(StiffnessStore&&) noexcept = default;

const std::string& StiffnessStore::path() const {
  return state_->file.path();
}

std::vector<std::string> StiffnessStore::objects() const {
  return state_->file.root().groups();
}

StiffnessFacts StiffnessStore::facts(const std::string& group) const {
  return read_facts(state_->file.root(), group);
}

StiffnessFacts StiffnessStore::facts(const model::Model& model) const {
  const std::uint64_t hash = stiffness_hash(model);
  std::string names;
  for (const std::string& name : objects()) {
    StiffnessFacts found = facts(name);
    if (found.hash == hash && found.nodes == model.nodes.size())
      return found;
    names += (names.empty() ? "'" : ", '") + found.object + "' (" + std::to_string(found.nodes) +
             " nodes, hash " + digest_text(found.hash) + ")";
  }
  throw Error(path(), "is of another model: it holds " + (names.empty() ? "nothing" : names) +
                          ", expected '" + model.name + "' (" + std::to_string(model.nodes.size()) +
                          " nodes, hash " + digest_text(hash) + ")");
}

std::optional<StiffnessFacts> StiffnessStore::second_stage(const StiffnessFacts& facts) const {
  if (!group_of(state_->file.root(), facts.group).has(store::second_stage))
    return std::nullopt;
  return this->facts(second_stage_group(facts.group));
}

StoreShard StiffnessStore::shard() const {
  const hdf5::Group& root = state_->file.root();
  if (!root.has_attribute("shard"))
    return {};
  const StoreShard shard{root.number<std::uint64_t>("shard"), root.number<std::uint64_t>("shards")};
  require(root, shard.index >= 1 && shard.index <= shard.count, "its shard");
  return shard;
}

StiffnessSizes StiffnessStore::sizes(const StiffnessFacts& facts) const {
  const hdf5::Group object = group_of(state_->file.root(), facts.group);
  StiffnessSizes sizes;
  sizes.matrix = object.group("K").dataset("x", hdf5::Number::float64).rows();
  sizes.factor = object.group("L").dataset("x", hdf5::Number::float64).rows();
  if (object.has("columns")) {
    sizes.touched = object.group("columns").dataset("nodes", hdf5::Number::uint32).rows();
    sizes.column_bytes = sizes.touched * 9 * rows_of(facts) * (facts.single ? 4 : 8);
  }
  if (object.has(store::compressed)) {
    const hdf5::Group compressed = object.group(store::compressed);
    sizes.touched = compressed.number<std::uint64_t>("touched");
    sizes.column_bytes = compressed.dataset("values", hdf5::Number::uint8).rows();
  }
  return sizes;
}

linalg::StiffnessMatrix StiffnessStore::matrix(const StiffnessFacts& facts) const {
  const hdf5::Group group = group_of(state_->file.root(), facts.group).group("K");
  linalg::StiffnessMatrix matrix;
  matrix.axis_of_row = read_places(group, "axis", facts.order);
  matrix.column_start = read_places(group, "p", facts.order + 1);
  matrix.row = read_places(group, "i");
  matrix.value = read_checked<double>(group, "x", matrix.row.size());
  check_matrix(group, matrix);
  matrix.row_of_axis.assign(3 * facts.nodes, -1);
  std::int64_t before = -1;
  for (std::size_t r = 0; r < matrix.axis_of_row.size(); ++r) {
    const std::int64_t axis = matrix.axis_of_row[r];
    require(group, axis > before && axis < static_cast<std::int64_t>(3 * facts.nodes), "its axes");
    before = axis;
    matrix.row_of_axis[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(r);
  }
  return matrix;
}

linalg::Factor StiffnessStore::factor(const StiffnessFacts& facts) const {
  const hdf5::Group group = group_of(state_->file.root(), facts.group).group("L");
  linalg::FactorData data;
  data.order = static_cast<std::int64_t>(facts.order);
  data.max_column_size = group.number<std::int64_t>("maxcsize");
  data.max_row_size = group.number<std::int64_t>("maxesize");
  data.permutation = read_places(group, "Perm", facts.order);
  data.column_count = read_places(group, "ColCount", facts.order);
  data.super = read_places(group, "super");
  data.pi = read_places(group, "pi", data.super.size());
  data.px = read_places(group, "px", data.super.size());
  data.s = read_places(group, "s");
  data.x = read_checked<double>(group, "x");
  return gewebe::at(path(), [&] { return linalg::Factor(std::move(data)); });
}

namespace {

/// Columns that stay in the file; `keep` keeps it open.
class StoredColumns final : public columns::ColumnSource {
public:
  StoredColumns(std::shared_ptr<const void> keep, const hdf5::Group& group,
                const StiffnessFacts& facts)
      : keep_(std::move(keep)), count_(facts.nodes), rows_(rows_of(facts)),
        nodes_(read_checked<std::uint32_t>(group, "nodes")),
        crc_(read_checked<std::uint32_t>(group, "crc32c", nodes_.size())),
        values_(
            group.dataset("values", facts.single ? hdf5::Number::float32 : hdf5::Number::float64)) {
    for (std::size_t k = 0; k < nodes_.size(); ++k)
      require(group, nodes_[k] < rows_ && (k == 0 || nodes_[k] > nodes_[k - 1]), "its nodes");
    values_.require_shape({nodes_.size(), 3, 3 * rows_});
  }

  std::size_t node_count() const override { return count_; }
  std::size_t row_nodes() const override { return rows_; }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }

  void read(std::size_t k, std::span<double> out) const override {
    if (!single()) {
      values_.read_rows(k, out);
      return check(k, crc32c(std::span<const double>(out)));
    }
    std::vector<float> row(out.size());
    read_single(k, row);
    std::copy(row.begin(), row.end(), out.begin());
  }
  bool single() const override { return values_.type() == hdf5::Number::float32; }
  void read_single(std::size_t k, std::span<float> out) const override {
    values_.read_rows(k, out);
    check(k, crc32c(std::span<const float>(out)));
  }

private:
  void check(std::size_t k, std::uint32_t crc) const {
    if (crc != crc_[k])
      values_.fail("the columns of node " + std::to_string(nodes_[k]) +
                   " are damaged: their checksum does not hold");
  }

  std::shared_ptr<const void> keep_;
  std::uint64_t count_, rows_;
  std::vector<std::uint32_t> nodes_, crc_;
  hdf5::Dataset values_;
};

/// Of a group of compressed columns.
columns::CompressedLayout read_layout(const hdf5::Group& group, const StiffnessFacts& facts) {
  columns::CompressedLayout layout;
  layout.relative = facts.compressed;
  layout.bound = group.number<double>("bound");
  layout.clusters.node = read_checked<std::uint32_t>(group, "order", rows_of(facts));
  layout.clusters.first = read_checked<std::uint32_t>(group, "first");
  layout.with_columns = group.number<std::uint64_t>("chunks");
  const std::vector<std::uint32_t> counts = read_checked<std::uint32_t>(group, "count");
  require(group, counts.size() % 2 == 0, "its blocks");
  for (std::size_t k = 0; k < counts.size(); k += 2)
    layout.count.push_back({counts[k], counts[k + 1]});
  try {
    columns::check_layout(layout, rows_of(facts));
  } catch (const Error& error) {
    group.fail(std::string("is damaged: ") + error.what());
  }
  require(group,
          group.number<std::uint64_t>("touched") == layout.clusters.first[layout.with_columns],
          "its number of nodes");
  return layout;
}

/// Reads chunks of compressed columns; keeps the file open.
class ChunkFile {
public:
  ChunkFile(std::shared_ptr<const void> keep, const hdf5::Group& group,
            const columns::CompressedLayout& layout)
      : keep_(std::move(keep)), size_(columns::chunk_sizes(layout)),
        crc_(read_checked<std::uint32_t>(group, "crc32c", size_.size())),
        values_(group.dataset("values", hdf5::Number::uint8)) {
    std::uint64_t end = 0;
    for (const std::uint64_t size : size_) {
      start_.push_back(end);
      end += size;
      require(group, end <= values_.rows(), "its chunks");
    }
    values_.require_shape({end});
  }

  std::vector<std::uint8_t> read(std::size_t chunk) const {
    std::vector<std::uint8_t> bytes(size_[chunk]);
    if (!bytes.empty())
      values_.read_rows(start_[chunk], std::span<std::uint8_t>(bytes));
    if (crc32c(bytes) != crc_[chunk])
      values_.fail("chunk " + std::to_string(chunk) + " is damaged: its checksum does not hold");
    return bytes;
  }

private:
  std::shared_ptr<const void> keep_;
  std::vector<std::uint64_t> size_, start_;
  std::vector<std::uint32_t> crc_;
  hdf5::Dataset values_;
};

} // namespace

std::unique_ptr<columns::ColumnSource> StiffnessStore::columns(const StiffnessFacts& facts) const {
  const hdf5::Group object = group_of(state_->file.root(), facts.group);
  if (object.has(store::compressed)) {
    const hdf5::Group group = object.group(store::compressed);
    columns::CompressedLayout layout = read_layout(group, facts);
    const auto file = std::make_shared<const ChunkFile>(state_, group, layout);
    return std::make_unique<columns::CompressedColumns>(
        std::move(layout), facts.nodes, [file](std::size_t chunk) { return file->read(chunk); });
  }
  if (!object.has("columns"))
    return nullptr;
  return std::make_unique<StoredColumns>(state_, object.group("columns"), facts);
}

} // namespace gewebe::formats
