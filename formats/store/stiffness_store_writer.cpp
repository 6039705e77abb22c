#include "formats/store/stiffness_store_writer.h"

#include "base/bytes.h"
#include "base/crc32c.h"
#include "base/digest.h"
#include "base/error.h"
#include "columns/compliance_columns.h"
#include "formats/store/column_journal_internal.h"
#include "formats/store/hdf5_internal.h"
#include "formats/store/stiffness_store_internal.h"
#include "formats/stream/raw_file_internal.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

namespace gewebe::formats {

namespace {

template <class T>
void write_checked(hdf5::Group& group, const std::string& name, std::span<const T> values,
                   const hdf5::Shape& shape) {
  group.write(name, values, shape).set("crc32c", crc32c(values));
}

template <class T>
void write_checked(hdf5::Group& group, const std::string& name, std::span<const T> values) {
  write_checked(group, name, values, {values.size()});
}

/// Numbers of rows and places, none below 0: in 32 bits where they fit, as nearly always.
void write_places(hdf5::Group& group, const std::string& name,
                  std::span<const std::int64_t> values) {
  if (std::ranges::any_of(values, [](std::int64_t v) { return v > UINT32_MAX; }))
    return write_checked<std::int64_t>(group, name, values);
  std::vector<std::uint32_t> narrow(values.size());
  std::ranges::transform(values, narrow.begin(),
                         [](std::int64_t v) { return static_cast<std::uint32_t>(v); });
  write_checked<std::uint32_t>(group, name, narrow);
}

void write_matrix(hdf5::Group& object, const linalg::StiffnessMatrix& matrix) {
  hdf5::Group group = object.create_group("K");
  write_places(group, "axis", matrix.axis_of_row);
  write_places(group, "p", matrix.column_start);
  write_places(group, "i", matrix.row);
  write_checked<double>(group, "x", matrix.value);
}

void write_factor(hdf5::Group& object, const linalg::FactorView& l) {
  hdf5::Group group = object.create_group("L");
  group.set("maxcsize", l.max_column_size);
  group.set("maxesize", l.max_row_size);
  write_places(group, "Perm", l.permutation);
  write_places(group, "ColCount", l.column_count);
  write_places(group, "super", l.super);
  write_places(group, "pi", l.pi);
  write_places(group, "px", l.px);
  write_places(group, "s", l.s);
  write_checked(group, "x", l.x);
}

void add_matrix(Digest& digest, const linalg::StiffnessMatrix& matrix) {
  digest.add(matrix.axis_of_row);
  digest.add(matrix.column_start);
  digest.add(matrix.row);
  digest.add(matrix.value);
}

void add_factor(Digest& digest, const linalg::FactorView& l) {
  for (const auto list : {l.permutation, l.column_count, l.super, l.pi, l.px, l.s})
    digest.add(list);
  digest.add(l.x);
}

/// The least float that isn't below a magnitude.
float round_up(double magnitude) {
  const auto near = static_cast<float>(magnitude);
  return static_cast<double>(near) < magnitude
             ? std::nextafter(near, std::numeric_limits<float>::infinity())
             : near;
}

void require_disk(const Output& output, double bytes) {
  std::error_code none;
  const std::filesystem::path folder = std::filesystem::path(output.temporary()).parent_path();
  const auto space = std::filesystem::space(folder.empty() ? "." : folder, none);
  if (!none && bytes > static_cast<double>(space.available))
    throw Error(output.name(), "the store needs " + bytes_text(bytes) + ", the disk has " +
                                   bytes_text(static_cast<double>(space.available)));
}

} // namespace

double stored_columns_bytes(std::size_t nodes, std::size_t row_nodes, bool single) {
  return static_cast<double>(nodes) * 3 *
         (3 * static_cast<double>(row_nodes) * (single ? 4 : 8) +
          4.0 * static_cast<double>(store::bound_blocks(row_nodes)));
}

double stiffness_store_bytes(const linalg::StiffnessMatrix& matrix, const linalg::Factor& factor,
                             std::size_t nodes, bool single, std::size_t row_nodes) {
  const linalg::FactorView l = factor.view();
  const double columns =
      stored_columns_bytes(nodes, std::min(row_nodes, matrix.row_of_axis.size() / 3), single);
  return 8 * (2 * static_cast<double>(matrix.order()) + 2 * static_cast<double>(matrix.row.size()) +
              2 * static_cast<double>(matrix.order()) + 3 * static_cast<double>(l.super.size()) +
              static_cast<double>(l.s.size()) + static_cast<double>(l.x.size())) +
         columns;
}

namespace {

void add_facts(hdf5::Group& object, const StiffnessFacts& facts) {
  object.set("name", facts.object);
  object.set("hash", facts.hash);
  object.set("rest_hash", facts.rest);
  object.set("nodes", facts.nodes);
  object.set("order", facts.order);
  object.set("method", facts.method.name);
  if (facts.method.name != "direct")
    object.set("force", facts.method.force);
  if (facts.method.name == "relax")
    object.set("velocity_threshold", facts.method.threshold);
  if (facts.method.name == "relax-fixed")
    object.set("steps", facts.method.steps);
  object.set("norm", facts.norm);
  object.set("condition", facts.condition);
  object.set("precision", facts.single ? "float32" : "float64");
  if (facts.row_nodes != 0)
    object.set("row_nodes", facts.row_nodes);
}

/// Of all that columns depend on, beside the model.
std::uint64_t work_digest(const StiffnessFacts& facts, const linalg::StiffnessMatrix& matrix,
                          const linalg::Factor& factor, std::span<const std::uint32_t> nodes) {
  Digest digest;
  add_matrix(digest, matrix);
  add_factor(digest, factor.view());
  digest.add_bytes(facts.method.name.data(), facts.method.name.size());
  for (const double value : {facts.method.force, facts.method.threshold,
                             static_cast<double>(facts.method.steps), facts.single ? 1.0 : 0.0})
    digest.add(value);
  digest.add(nodes);
  if (facts.row_nodes != 0)
    digest.add(facts.row_nodes);
  return digest.value();
}

std::uint64_t digest_of(const void* data, std::size_t size) {
  Digest digest;
  digest.add_bytes(data, size);
  return digest.value();
}

/// Checks of columns when they are written, and when they are resumed.
struct ColumnSums {
  std::vector<std::uint32_t> crc;
  std::vector<std::uint64_t> digest;
  std::vector<double> residual;
  std::vector<float> bound; ///< [node][3][block]

  void resize(std::size_t count, std::uint64_t nodes) {
    crc.assign(count, 0);
    digest.assign(count, 0);
    residual.assign(count, 0);
    bound.assign(count * 3 * store::bound_blocks(nodes), 0);
  }

  template <class T>
  void add(std::size_t k, std::span<const T> stored, std::uint32_t its_crc, double its_residual) {
    crc[k] = its_crc;
    digest[k] = digest_of(stored.data(), stored.size_bytes());
    residual[k] = its_residual;
    const std::size_t axes = stored.size() / 3, block = 3 * store::bound_nodes;
    auto to = bound.begin() + static_cast<std::ptrdiff_t>(k * 3 * store::bound_blocks(axes / 3));
    for (std::size_t column = 0; column < 3; ++column)
      for (std::size_t begin = 0; begin < axes; begin += block) {
        T largest = 0;
        for (std::size_t i = begin; i < std::min(begin + block, axes); ++i)
          largest = std::max(largest, std::abs(stored[column * axes + i]));
        *to++ = round_up(static_cast<double>(largest));
      }
  }
};

/// Where columns stand in the file.
struct Place {
  std::uint64_t offset = 0, bytes = 0;
};

/// All of `from` to `to`, but not the columns, which stand there already.
void copy_frame(const RawFile& from, RawFile& to, std::vector<Place> columns,
                const std::string& name) {
  std::ranges::sort(columns, {}, &Place::offset);
  std::vector<char> block(std::size_t{1} << 20);
  const std::uint64_t size = from.size();
  std::uint64_t at = 0;
  const auto copy_until = [&](std::uint64_t end) {
    while (at < end) {
      const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(end - at, block.size()));
      if (!from.read(at, block.data(), part))
        throw Error(name, "cannot be copied to its place");
      to.write(at, block.data(), part);
      at += part;
    }
  };
  for (const Place& place : columns) {
    copy_until(std::min(place.offset, size));
    at = std::max(at, place.offset + place.bytes);
  }
  copy_until(size);
  to.resize(size);
}

} // namespace

struct StiffnessStoreWriter::State {
  Output& output;
  std::optional<RawFile> frame; ///< HDF5's file where it isn't the output
  hdf5::File file;
  RawFile data; ///< where columns go, and in the end all
  std::optional<ColumnJournal> journal;
  std::vector<Place> places;
  std::uint64_t kept = 0;
  std::vector<std::uint32_t> damaged;
  Digest digest, matrix_digest;
  // The object under way:
  std::optional<hdf5::Group> object, columns;
  bool single = false;
  std::uint64_t row_bytes = 0;
  std::size_t together = 1;         ///< nodes whose columns were checked together
  std::vector<std::size_t> missing; ///< index of each node that is still to come
  ColumnSums sums;
  std::vector<float> row;

  explicit State(Output& to)
      : output(to), frame(frame_of(to)),
        file(frame ? hdf5::File::create_by_link(frame->path(), to.name())
                   : hdf5::File::create(to.temporary(), to.name())),
        data(to.temporary(), to.name()) {
    if (to.part())
      journal.emplace(to.temporary(), data.size());
  }

  static std::optional<RawFile> frame_of(const Output& to) {
    if (!to.part())
      return std::nullopt;
    return RawFile::nameless(to.temporary(), to.name());
  }

  std::uint64_t place_of(std::size_t k) const { return places.back().offset + k * row_bytes; }

  template <class T>
  void write(std::size_t k, std::span<const T> stored, double residual) {
    const std::uint32_t crc = crc32c(stored);
    if (journal) {
      journal->make();
      output.keep_part();
    }
    data.write(place_of(k), stored.data(), stored.size_bytes());
    if (journal)
      journal->add(k, {crc, residual});
    sums.add(k, stored, crc, residual);
  }

  /// Whether the columns are there and whole.
  template <class T>
  bool take_up(std::size_t k, const ColumnRecord& record) {
    std::vector<T> stored(row_bytes / sizeof(T));
    if (!data.read(place_of(k), stored.data(), row_bytes))
      return false;
    const std::uint32_t crc = crc32c(stored);
    if (crc != record.crc)
      return false;
    sums.add(k, std::span<const T>(stored), crc, record.residual);
    return true;
  }

  /// Sets `missing`. Columns that were checked together are kept together.
  void take_up(std::span<const std::uint32_t> nodes,
               std::span<const std::optional<ColumnRecord>> finished) {
    for (std::size_t first = 0; first < nodes.size(); first += together) {
      const std::size_t end = std::min(first + together, nodes.size());
      bool whole = true;
      for (std::size_t k = first; k < end; ++k) {
        if (!finished[k]) {
          whole = false;
        } else if (!(single ? take_up<float>(k, *finished[k]) : take_up<double>(k, *finished[k]))) {
          whole = false;
          damaged.push_back(nodes[k]);
        }
      }
      for (std::size_t k = first; k < end && !whole; ++k)
        missing.push_back(k);
      if (whole)
        kept += end - first;
    }
  }
};

StiffnessStoreWriter::StiffnessStoreWriter(Output& output, const StoreShard& shard)
    : state_(std::make_unique<State>(output)) {
  hdf5::Group& root = state_->file.root();
  root.set("format", store::format);
  root.set("version", store::version);
  if (shard.count > 1) {
    root.set("shard", shard.index);
    root.set("shards", shard.count);
  }
}

StiffnessStoreWriter::~StiffnessStoreWriter() = default;

namespace {

hdf5::Group create_object(hdf5::File& file, const std::string& group) {
  const std::size_t slash = group.find('/');
  hdf5::Group& root = file.root();
  if (slash != std::string::npos)
    return root.group(group.substr(0, slash)).create_group(group.substr(slash + 1));
  if (root.has(group))
    throw Error(file.path(),
                "two objects are named '" + group + "', expected different names (exp2ela --name)");
  return root.create_group(group);
}

} // namespace

std::vector<std::uint32_t> StiffnessStoreWriter::begin(const StiffnessFacts& facts,
                                                       const linalg::StiffnessMatrix& matrix,
                                                       const linalg::Factor& factor,
                                                       std::span<const std::uint32_t> nodes) {
  State& s = *state_;
  const bool plain = !nodes.empty() && facts.compressed == 0;
  const std::uint64_t rows = rows_of(facts);
  require_disk(s.output,
               stiffness_store_bytes(matrix, factor, plain ? nodes.size() : 0, facts.single, rows) -
                   static_cast<double>(s.data.stored()));
  const std::string group = facts.group.empty() ? hdf5::link_name(facts.object) : facts.group;
  s.object = create_object(s.file, group);
  s.single = facts.single;
  add_facts(*s.object, facts);
  add_matrix(s.digest, matrix);
  add_matrix(s.matrix_digest, matrix);
  write_matrix(*s.object, matrix);
  add_factor(s.digest, factor.view());
  write_factor(*s.object, factor.view());
  s.together = facts.method.name == "direct" ? columns::compliance_block : 1;
  s.missing.clear();
  s.damaged.clear();
  s.sums.resize(plain ? nodes.size() : 0, rows);
  if (!plain)
    return {nodes.begin(), nodes.end()};
  s.columns = s.object->create_group("columns");
  write_checked(*s.columns, "nodes", nodes);
  const hdf5::Dataset values =
      s.columns->create_dataset("values", s.single ? hdf5::Number::float32 : hdf5::Number::float64,
                                {nodes.size(), 3, 3 * rows});
  s.row_bytes = 9 * rows * (s.single ? sizeof(float) : sizeof(double));
  s.places.push_back({values.offset(), nodes.size() * s.row_bytes});
  std::vector<std::optional<ColumnRecord>> finished(nodes.size());
  if (s.journal)
    finished = s.journal->begin({facts.hash, work_digest(facts, matrix, factor, nodes), group},
                                nodes.size());
  s.take_up(nodes, finished);
  std::vector<std::uint32_t> missing;
  for (const std::size_t k : s.missing)
    missing.push_back(nodes[k]);
  return missing;
}

void StiffnessStoreWriter::write(std::size_t k, std::span<const double> columns, double residual) {
  State& s = *state_;
  if (!s.single)
    return s.write(s.missing[k], columns, residual);
  s.row.resize(columns.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    s.row[i] = static_cast<float>(columns[i]);
    if (!std::isfinite(s.row[i]))
      throw Error(s.file.path(), "a displacement under unit force is too large for float32, "
                                 "expected float64");
  }
  s.write(s.missing[k], std::span<const float>(s.row), residual);
}

void StiffnessStoreWriter::write_compressed(const columns::CompressedMade& columns) {
  State& s = *state_;
  const columns::CompressedLayout& layout = columns.layout;
  hdf5::Group group = s.object->create_group(store::compressed);
  group.set("relative", layout.relative);
  group.set("bound", layout.bound);
  group.set("chunks", std::uint64_t{layout.with_columns});
  group.set("touched", std::uint64_t{layout.clusters.first[layout.with_columns]});
  write_checked<std::uint32_t>(group, "order", layout.clusters.node);
  write_checked<std::uint32_t>(group, "first", layout.clusters.first);
  std::vector<std::uint32_t> counts, crc;
  for (const columns::CrossCount& count : layout.count) {
    counts.push_back(count.wide);
    counts.push_back(count.narrow);
  }
  write_checked<std::uint32_t>(group, "count", counts);
  std::uint64_t size = 0, at = 0;
  std::vector<std::uint64_t> digests;
  for (const std::vector<std::uint8_t>& chunk : columns.chunks) {
    crc.push_back(crc32c(chunk));
    digests.push_back(digest_of(chunk.data(), chunk.size()));
    size += chunk.size();
  }
  require_disk(s.output, static_cast<double>(size));
  write_checked<std::uint32_t>(group, "crc32c", crc);
  hdf5::Dataset values = group.create_dataset("values", hdf5::Number::uint8, {size});
  for (const std::vector<std::uint8_t>& chunk : columns.chunks) {
    if (!chunk.empty())
      values.write_rows(at, std::span<const std::uint8_t>(chunk));
    at += chunk.size();
  }
  s.digest.add(layout.clusters.node);
  s.digest.add(counts);
  s.digest.add(digests);
}

double StiffnessStoreWriter::end(double residual) {
  State& s = *state_;
  for (const double of_column : s.sums.residual)
    residual = std::max(residual, of_column);
  s.object->set("residual", residual);
  s.digest.add(s.sums.digest);
  if (s.columns) {
    const std::uint64_t count = s.sums.crc.size();
    write_checked<std::uint32_t>(*s.columns, "crc32c", s.sums.crc);
    write_checked<float>(*s.columns, "bound", s.sums.bound,
                         {count, 3, s.sums.bound.size() / (3 * count)});
    s.columns->set("bound_nodes", static_cast<std::int64_t>(store::bound_nodes));
  }
  s.columns.reset();
  s.object.reset();
  return residual;
}

void StiffnessStoreWriter::close() {
  State& s = *state_;
  s.file.close();
  if (!s.frame)
    return;
  s.journal->make();
  copy_frame(*s.frame, s.data, s.places, s.output.name());
}

void StiffnessStoreWriter::remove_journal() {
  if (state_->journal)
    state_->journal->remove();
}

std::uint64_t StiffnessStoreWriter::kept() const {
  return state_->kept;
}

const std::vector<std::uint32_t>& StiffnessStoreWriter::damaged() const {
  return state_->damaged;
}

std::uint64_t StiffnessStoreWriter::digest() const {
  return state_->digest.value();
}

std::uint64_t StiffnessStoreWriter::matrix_digest() const {
  return state_->matrix_digest.value();
}

} // namespace gewebe::formats
