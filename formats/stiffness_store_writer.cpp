#include "formats/stiffness_store_writer.h"

#include "base/bytes.h"
#include "base/crc32c.h"
#include "base/digest.h"
#include "base/error.h"
#include "formats/hdf5_internal.h"
#include "formats/stiffness_store_internal.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

namespace gewebe {

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

void write_matrix(hdf5::Group& object, const StiffnessMatrix& matrix) {
  hdf5::Group group = object.create_group("K");
  write_checked<std::int64_t>(group, "axis", matrix.axis_of_row);
  write_checked<std::int64_t>(group, "p", matrix.column_start);
  write_checked<std::int64_t>(group, "i", matrix.row);
  write_checked<double>(group, "x", matrix.value);
}

void write_factor(hdf5::Group& object, const FactorView& l) {
  hdf5::Group group = object.create_group("L");
  group.set("maxcsize", l.max_column_size);
  group.set("maxesize", l.max_row_size);
  write_checked(group, "Perm", l.permutation);
  write_checked(group, "ColCount", l.column_count);
  write_checked(group, "super", l.super);
  write_checked(group, "pi", l.pi);
  write_checked(group, "px", l.px);
  write_checked(group, "s", l.s);
  write_checked(group, "x", l.x);
}

void add_matrix(Digest& digest, const StiffnessMatrix& matrix) {
  digest.add(matrix.axis_of_row);
  digest.add(matrix.column_start);
  digest.add(matrix.row);
  digest.add(matrix.value);
}

void add_factor(Digest& digest, const FactorView& l) {
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

double stiffness_store_bytes(const StiffnessMatrix& matrix, const Factor& factor, std::size_t nodes,
                             bool single) {
  const FactorView l = factor.view();
  const double columns =
      static_cast<double>(nodes) * 3 *
      (static_cast<double>(matrix.row_of_axis.size()) * (single ? 4 : 8) +
       4.0 * static_cast<double>(store::bound_blocks(matrix.row_of_axis.size() / 3)));
  return 8 * (2 * static_cast<double>(matrix.order()) + 2 * static_cast<double>(matrix.row.size()) +
              2 * static_cast<double>(matrix.order()) + 3 * static_cast<double>(l.super.size()) +
              static_cast<double>(l.s.size()) + static_cast<double>(l.x.size())) +
         columns;
}

struct StiffnessStoreWriter::State {
  const Output& output;
  hdf5::File file;
  Digest digest, matrix_digest;
  // The object under way:
  std::optional<hdf5::Group> object, columns;
  std::optional<hdf5::Dataset> values;
  std::uint64_t nodes = 0; ///< of the model
  bool single = false;
  std::vector<std::uint32_t> crc; ///< of the columns so far
  std::vector<float> bounds, row;

  explicit State(const Output& to)
      : output(to), file(hdf5::File::create(to.temporary(), to.name())) {}

  template <class T>
  void write(std::size_t k, std::span<const T> stored) {
    values->write_rows(k, stored);
    crc.push_back(crc32c(stored));
    digest.add(stored);
    const std::size_t axes = 3 * nodes, block = 3 * store::bound_nodes;
    for (std::size_t column = 0; column < 3; ++column)
      for (std::size_t begin = 0; begin < axes; begin += block) {
        double largest = 0;
        for (std::size_t i = begin; i < std::min(begin + block, axes); ++i)
          largest = std::max(largest, std::abs(static_cast<double>(stored[column * axes + i])));
        bounds.push_back(round_up(largest));
      }
  }
};

StiffnessStoreWriter::StiffnessStoreWriter(Output& output)
    : state_(std::make_unique<State>(output)) {
  hdf5::Group& root = state_->file.root();
  root.set("format", store::format);
  root.set("version", store::version);
}

void StiffnessStoreWriter::begin(const StiffnessFacts& facts, const StiffnessMatrix& matrix,
                                 const Factor& factor, std::span<const std::uint32_t> nodes) {
  State& s = *state_;
  require_disk(s.output, stiffness_store_bytes(matrix, factor, nodes.size(), facts.single));
  const std::string group = hdf5::link_name(facts.group.empty() ? facts.object : facts.group);
  if (s.file.root().has(group))
    throw Error(s.file.path(),
                "two objects are named '" + group + "', expected different names (exp2ela --name)");
  s.object = s.file.root().create_group(group);
  s.nodes = facts.nodes;
  s.single = facts.single;
  s.object->set("name", facts.object);
  s.object->set("hash", facts.hash);
  s.object->set("nodes", facts.nodes);
  s.object->set("order", facts.order);
  s.object->set("method", "direct");
  s.object->set("norm", facts.norm);
  s.object->set("condition", facts.condition);
  s.object->set("precision", facts.single ? "float32" : "float64");
  add_matrix(s.digest, matrix);
  add_matrix(s.matrix_digest, matrix);
  write_matrix(*s.object, matrix);
  add_factor(s.digest, factor.view());
  write_factor(*s.object, factor.view());
  if (nodes.empty())
    return;
  s.columns = s.object->create_group("columns");
  write_checked(*s.columns, "nodes", nodes);
  s.values =
      s.columns->create_dataset("values", s.single ? hdf5::Number::float32 : hdf5::Number::float64,
                                {nodes.size(), 3, 3 * s.nodes});
}

StiffnessStoreWriter::~StiffnessStoreWriter() = default;

void StiffnessStoreWriter::write(std::size_t k, std::span<const double> columns) {
  State& s = *state_;
  if (!s.single)
    return s.write(k, columns);
  s.row.resize(columns.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    s.row[i] = static_cast<float>(columns[i]);
    if (!std::isfinite(s.row[i]))
      throw Error(s.file.path(), "a displacement under unit force is too large for float32, "
                                 "expected float64");
  }
  s.write(k, std::span<const float>(s.row));
}

void StiffnessStoreWriter::end(double residual) {
  State& s = *state_;
  s.object->set("residual", residual);
  if (s.columns) {
    write_checked<std::uint32_t>(*s.columns, "crc32c", s.crc);
    write_checked<float>(*s.columns, "bound", s.bounds,
                         {s.crc.size(), 3, store::bound_blocks(s.nodes)});
    s.columns->set("bound_nodes", static_cast<std::int64_t>(store::bound_nodes));
  }
  s.values.reset();
  s.columns.reset();
  s.object.reset();
  s.crc.clear();
  s.bounds.clear();
}

void StiffnessStoreWriter::close() {
  state_->file.close();
}

std::uint64_t StiffnessStoreWriter::digest() const {
  return state_->digest.value();
}

std::uint64_t StiffnessStoreWriter::matrix_digest() const {
  return state_->matrix_digest.value();
}

} // namespace gewebe
