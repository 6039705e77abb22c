// The stiffness store: what is read is what was written, and damage is found.

#include "formats/store/stiffness_store.h"

#include "base/crc32c.h"
#include "columns/column_compression.h"
#include "columns/compliance_columns.h"
#include "fem/model_stiffness.h"
#include "formats/store/hdf5_internal.h"
#include "formats/store/stiffness_store_writer.h"
#include "formats/stream/raw_file_internal.h"
#include "larger.h"
#include "linalg/condition.h"
#include "scratch.h"
#include "stiffness_models.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <string>
#include <unistd.h>

using namespace gewebe;
using namespace gewebe::test;

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_bytes(const std::string& path, const Bytes& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

std::uint64_t write_store(const std::string& path, const model::Model& model,
                          const std::vector<std::uint32_t>& nodes, bool single = false,
                          int threads = 1, double compressed = 0) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  formats::StiffnessFacts facts;
  linalg::StiffnessCheck check;
  const linalg::Factor factor = linalg::checked_factor(model, k, {}, check);
  facts.object = model.name;
  facts.hash = formats::stiffness_hash(model);
  facts.nodes = model.nodes.size();
  facts.order = k.order();
  facts.norm = check.norm;
  facts.condition = check.condition;
  facts.single = single;
  facts.compressed = compressed;
  formats::Output output(path, {});
  formats::StiffnessStoreWriter writer(output);
  writer.begin(facts, k, factor, nodes);
  Context context;
  context.threads = threads;
  double residual = 0;
  if (compressed > 0) {
    std::vector<Vec3> positions;
    for (const model::Node& node : model.nodes)
      positions.push_back(node.position);
    const columns::CompressedMade made = columns::compress_columns(
        positions, nodes, compressed,
        [&](std::span<const std::uint32_t> of, columns::ColumnSink& sink) {
          return columns::compliance_columns(k, factor, check.norm, of, context, sink);
        },
        context);
    writer.write_compressed(made);
    residual = made.residual;
  } else {
    residual = columns::compliance_columns(k, factor, check.norm, nodes, context, writer);
  }
  writer.end(std::max(residual, check.residual));
  writer.close();
  output.commit();
  return writer.digest();
}

/// Everything that a store says, as bytes.
std::vector<double> contents(const formats::StiffnessStore& store) {
  std::vector<double> all;
  const auto add = [&](const auto& list) {
    all.push_back(static_cast<double>(list.size()));
    all.insert(all.end(), list.begin(), list.end());
  };
  for (const std::string& name : store.objects()) {
    const formats::StiffnessFacts facts = store.facts(name);
    add(facts.object);
    for (const double value :
         {static_cast<double>(facts.hash >> 32), static_cast<double>(facts.hash & UINT32_MAX),
          static_cast<double>(facts.nodes), static_cast<double>(facts.order), facts.norm,
          facts.condition, facts.residual, facts.single ? 1.0 : 0.0})
      all.push_back(value);
    const linalg::StiffnessMatrix k = store.matrix(facts);
    add(k.column_start);
    add(k.row);
    add(k.value);
    add(k.axis_of_row);
    const linalg::FactorData l = store.factor(facts).data();
    for (const auto* list : {&l.permutation, &l.column_count, &l.super, &l.pi, &l.px, &l.s})
      add(*list);
    add(l.x);
    if (const auto columns = store.columns(facts)) {
      add(columns->nodes());
      std::vector<double> row(9 * columns->node_count());
      for (std::size_t i = 0; i < columns->nodes().size(); ++i) {
        columns->read(i, row);
        add(row);
      }
    }
  }
  return all;
}

std::string refusal(const std::string& path) {
  try {
    (void)contents(formats::StiffnessStore(path));
  } catch (const Error& error) {
    return error.place() + ": " + error.what();
  }
  return "accepted";
}

model::Model small_model() {
  model::Model model = model_of(octahedron(), 1);
  model.nodes[0].fixed = model.nodes[2].fixed = model::fixed_all;
  model.nodes[4].fixed = model::fixed_x | model::fixed_z;
  model.name = "two/parts of it";
  return model;
}

} // namespace

TEST(RawFile, WithoutANameIsOnTheDiskOrInMemory) {
  const ScratchFile beside(".part");
  for (const std::string& place : {beside.path(), std::string("/proc/none")}) { // that has no such
    formats::RawFile file = formats::RawFile::nameless(place, "test");
    file.write(3, "abc", 3);
    EXPECT_EQ(file.size(), 6U);
    std::ifstream again(file.path());
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(again), {}), std::string("\0\0\0abc", 6));
    std::array<char, 300> target{};
    EXPECT_GT(::readlink(file.path().c_str(), target.data(), target.size() - 1), 0);
    EXPECT_NE(std::string(target.data()).find(" (deleted)"), std::string::npos);
    EXPECT_EQ(std::string(target.data()).starts_with("/memfd:"), place == "/proc/none");
  }
  EXPECT_THROW((void)formats::RawFile::nameless("/nowhere/x", "test"), Error);
}

TEST(Crc32c, KnownValues) {
  EXPECT_EQ(crc32c("123456789", 9), 0xE3069283U);
  EXPECT_EQ(crc32c("", 0), 0U);
  const std::vector<std::uint8_t> zeros(32), ones(32, 0xff);
  EXPECT_EQ(crc32c(zeros), 0x8A9136AAU); // RFC 3720, B.4
  EXPECT_EQ(crc32c(ones), 0x62A8AB43U);
  EXPECT_EQ(crc32c("56789", 5, crc32c("1234", 4)), 0xE3069283U);
}

TEST(Store, GivesBackTheSameBits) {
  const model::Model model = small_model();
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  for (const bool single : {false, true}) {
    const ScratchFile file(".h5");
    write_store(file.path(), model, {0, 1, 5}, single);
    const formats::StiffnessStore store(file.path());
    EXPECT_EQ(store.objects(), std::vector<std::string>{"two_parts of it"});
    const formats::StiffnessFacts facts = store.facts(model);
    EXPECT_EQ(facts.object, model.name);
    EXPECT_EQ(facts.order, k.order());
    EXPECT_EQ(facts.single, single);
    EXPECT_LE(facts.residual, linalg::max_backward_error);
    const linalg::StiffnessMatrix read = store.matrix(facts);
    EXPECT_EQ(read.value, k.value);
    EXPECT_EQ(read.row, k.row);
    EXPECT_EQ(read.column_start, k.column_start);
    EXPECT_EQ(read.axis_of_row, k.axis_of_row);
    EXPECT_EQ(read.row_of_axis, k.row_of_axis);
    const linalg::Factor factor(k, {}), again = store.factor(facts);
    const std::vector<double> f = random_vector(3 * model.nodes.size(), 1);
    std::vector<double> a(f.size()), b(f.size());
    linalg::solve_axes(k, factor, f, a);
    linalg::solve_axes(k, again, f, b);
    EXPECT_EQ(a, b);
    const auto columns = store.columns(facts);
    ASSERT_NE(columns, nullptr);
    EXPECT_EQ(columns->node_count(), model.nodes.size());
    EXPECT_EQ(columns->nodes(), (std::vector<std::uint32_t>{0, 1, 5}));
    std::vector<double> row(9 * model.nodes.size());
    columns->read(1, row);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::fill(a.begin(), a.end(), 0.0);
      a[3 + axis] = 1;
      linalg::solve_axes(k, factor, a, b);
      for (std::size_t i = 0; i < b.size(); ++i)
        EXPECT_EQ(row[axis * b.size() + i],
                  single ? static_cast<double>(static_cast<float>(b[i])) : b[i]);
    }
  }
}

TEST(Store, CompressedColumnsAreWithinTheirBoundAndReadByChunk) {
  const model::Model model = model_of(ball(3));
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model.nodes.size(); i += i % 4 == 0 ? 2 : 1)
    nodes.push_back(i);
  const ScratchFile plain(".h5"), small(".h5"), again(".h5");
  write_store(plain.path(), model, nodes);
  const std::uint64_t digest = write_store(small.path(), model, nodes, false, 1, 1e-3);
  EXPECT_EQ(write_store(again.path(), model, nodes, false, 5, 1e-3), digest);
  EXPECT_EQ(bytes_of(small.path()), bytes_of(again.path()));
  EXPECT_NE(write_store(again.path(), model, nodes, false, 5, 1e-4), digest);
  const formats::StiffnessStore of_plain(plain.path()), of_small(small.path());
  const formats::StiffnessFacts facts = of_small.facts(model);
  EXPECT_EQ(facts.compressed, 1e-3);
  const formats::StiffnessSizes sizes = of_small.sizes(facts);
  EXPECT_EQ(sizes.touched, nodes.size());
  EXPECT_LT(sizes.column_bytes, of_plain.sizes(of_plain.facts(model)).column_bytes / 4);
  const auto exact = of_plain.columns(of_plain.facts(model));
  const auto columns = of_small.columns(facts);
  ASSERT_NE(columns->compressed(), nullptr);
  EXPECT_EQ(exact->compressed(), nullptr);
  ASSERT_EQ(columns->nodes(), nodes);
  std::vector<double> row(9 * model.nodes.size()), expected(row);
  double worst = 0, most = 0;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    columns->read(k, row);
    exact->read(k, expected);
    for (std::size_t r = 0; r < row.size(); ++r) {
      worst = test::larger(worst, std::abs(row[r] - expected[r]));
      most = test::larger(most, std::abs(expected[r]));
    }
  }
  EXPECT_LE(worst, 1e-3 * most);
  EXPECT_LE(columns->compressed()->layout().bound, 1e-3 * most);
  const auto fresh = of_small.columns(facts);
  (void)fresh->compressed()->block(nodes.back(), nodes.front());
  EXPECT_EQ(fresh->compressed()->chunks_read(), 1U);
}

TEST(Store, CompressedColumnsThatContradictThemselvesAreRefused) {
  const model::Model model = small_model();
  const ScratchFile file(".h5");
  const auto write = [&](auto&& spoil) {
    linalg::StiffnessCheck check;
    const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
    const linalg::Factor factor = linalg::checked_factor(model, k, {}, check);
    formats::StiffnessFacts facts;
    facts.object = "x";
    facts.hash = formats::stiffness_hash(model);
    facts.nodes = model.nodes.size();
    facts.order = k.order();
    facts.norm = check.norm;
    facts.condition = check.condition;
    facts.compressed = 1e-3;
    const std::vector<std::uint32_t> nodes{1, 3, 4};
    std::vector<Vec3> positions;
    for (const model::Node& node : model.nodes)
      positions.push_back(node.position);
    columns::CompressedMade made = columns::compress_columns(
        positions, nodes, 1e-3,
        [&](std::span<const std::uint32_t> of, columns::ColumnSink& sink) {
          return columns::compliance_columns(k, factor, check.norm, of, {}, sink);
        },
        {});
    spoil(made);
    formats::Output output(file.path(), {});
    formats::StiffnessStoreWriter writer(output);
    writer.begin(facts, k, factor, nodes);
    writer.write_compressed(made);
    writer.end(0);
    writer.close();
    output.commit();
    return refusal(file.path());
  };
  EXPECT_EQ(write([](columns::CompressedMade&) {}), "accepted");
  const auto says = [&](auto&& spoil, const char* what) {
    const std::string said = write(spoil);
    EXPECT_NE(said.find(what), std::string::npos) << said;
  };
  says([](columns::CompressedMade& m) { m.layout.clusters.node[0] = m.layout.clusters.node[1]; },
       "their nodes");
  says([](columns::CompressedMade& m) { m.layout.clusters.node.pop_back(); }, "has shape");
  says([](columns::CompressedMade& m) { --m.layout.clusters.first.back(); }, "their clusters");
  says([](columns::CompressedMade& m) { m.layout.count.pop_back(); }, "their blocks");
  says([](columns::CompressedMade& m) { ++m.layout.count[0].narrow; }, "its chunks");
  says([](columns::CompressedMade& m) { m.layout.count[1].wide = 1U << 31; }, "their blocks");
  says([](columns::CompressedMade& m) { m.chunks[0].push_back(0); }, "has shape");
  says([](columns::CompressedMade& m) { m.layout.bound = 0; }, "their bound");
  says([](columns::CompressedMade& m) { m.layout.relative = NAN; }, "its bound");
}

TEST(Store, ColumnsOutliveTheStoreAndMayBeAbsent) {
  const model::Model model = small_model();
  const ScratchFile file(".h5"), without(".h5");
  write_store(file.path(), model, {3});
  std::unique_ptr<columns::ColumnSource> columns;
  {
    const formats::StiffnessStore store(file.path());
    columns = store.columns(store.facts(model));
  }
  std::vector<double> row(9 * model.nodes.size());
  EXPECT_NO_THROW(columns->read(0, row));
  EXPECT_THROW(columns->read(1, row), Error);
  write_store(without.path(), model, {});
  const formats::StiffnessStore store(without.path());
  EXPECT_EQ(store.columns(store.facts(model)), nullptr);
}

TEST(Store, BoundsAreNeverBelowTheColumns) {
  const model::Model model = model_of(ball(3));
  const ScratchFile file(".h5");
  write_store(file.path(), model, {1, 100});
  const formats::hdf5::File raw = formats::hdf5::File::open(file.path());
  const formats::hdf5::Group group = raw.root().group("ball").group("columns");
  const formats::hdf5::Dataset values = group.dataset("values", formats::hdf5::Number::float64);
  const formats::hdf5::Dataset bound = group.dataset("bound", formats::hdf5::Number::float32);
  const std::size_t n = model.nodes.size(), blocks = (n + 255) / 256;
  bound.require_shape({2, 3, blocks});
  std::vector<double> x(18 * n);
  std::vector<float> b(6 * blocks);
  values.read_rows(0, std::span<double>(x));
  bound.read_rows(0, std::span<float>(b));
  for (std::size_t c = 0; c < 6; ++c)
    for (std::size_t k = 0; k < blocks; ++k) {
      double max = 0;
      for (std::size_t i = k * 768; i < std::min(k * 768 + 768, 3 * n); ++i)
        max = test::larger(max, std::abs(x[c * 3 * n + i]));
      EXPECT_GE(b[c * blocks + k], max);
      EXPECT_LE(b[c * blocks + k], max * (1 + 1e-6));
    }
}

TEST(Store, BytesAreTheSameFromRunToRunAndForAnyThreads) {
  const model::Model model = model_of(ball(2));
  const ScratchFile a(".h5"), b(".h5"), c(".h5");
  std::vector<std::uint32_t> nodes(40);
  for (std::uint32_t i = 0; i < 40; ++i)
    nodes[i] = i;
  const std::uint64_t digest = write_store(a.path(), model, nodes, false, 1);
  EXPECT_EQ(write_store(b.path(), model, nodes, false, 2), digest);
  EXPECT_EQ(bytes_of(a.path()), bytes_of(b.path()));
  nodes.pop_back();
  EXPECT_NE(write_store(c.path(), model, nodes, false, 2), digest);
  EXPECT_NE(bytes_of(a.path()), bytes_of(c.path()));
}

TEST(Store, HashFollowsWhatCounts) {
  const model::Model model = model_of(ball(1));
  const std::uint64_t hash = formats::stiffness_hash(model);
  model::Model other = model;
  other.name = "other";
  other.springs[3].damping *= 2;
  other.nodes[3].drag *= 2;
  EXPECT_EQ(formats::stiffness_hash(other), hash);
  const auto changes = [&](auto&& change) {
    model::Model changed = model;
    change(changed);
    return formats::stiffness_hash(changed) != hash;
  };
  EXPECT_TRUE(changes([](model::Model& m) { m.springs[3].stiffness *= 1 + 1e-15; }));
  EXPECT_TRUE(changes([](model::Model& m) { m.springs[3].rest += 1e-12; }));
  EXPECT_TRUE(changes([](model::Model& m) { m.springs.pop_back(); }));
  EXPECT_TRUE(changes([](model::Model& m) { m.nodes[2].fixed = model::fixed_x; }));
  EXPECT_TRUE(changes([](model::Model& m) { m.nodes[2].mass *= 2; }));
  EXPECT_TRUE(changes([](model::Model& m) { m.nodes[2].position.z += 1e-12; }));
}

TEST(Store, OfAnotherModelIsRefusedByName) {
  const ScratchFile file(".h5");
  model::Model model = small_model();
  write_store(file.path(), model, {});
  const formats::StiffnessStore store(file.path());
  model.name = "renamed"; // is still the same model
  EXPECT_NO_THROW((void)store.facts(model));
  model.springs[0].stiffness *= 2;
  try {
    (void)store.facts(model);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.place(), file.path());
    const std::string what = error.what();
    EXPECT_EQ(what.find("is of another model: it holds 'two/parts of it' ("), 0) << what;
    EXPECT_NE(what.find("expected 'renamed' ("), std::string::npos) << what;
  }
}

TEST(Store, WhatIsNoStoreIsRefusedByName) {
  EXPECT_EQ(refusal("/nonexistent/x.h5"),
            "/nonexistent/x.h5: cannot open: No such file or directory");
  EXPECT_EQ(refusal("/tmp"), "/tmp: is a directory, expected a file");
  EXPECT_EQ(refusal("/dev/null"),
            "/dev/null: is no regular file, expected one, since HDF5 is not read forwards");
  const ScratchFile file(".h5");
  EXPECT_EQ(refusal(file.path()), file.path() + ": is empty");
  write_bytes(file.path(), Bytes(1000, 'x'));
  EXPECT_EQ(refusal(file.path()),
            file.path() + ": byte 0: no HDF5 file, expected the magic bytes of one");
  const auto with_root = [&](auto&& fill) {
    formats::hdf5::File made = formats::hdf5::File::create(file.path());
    fill(made.root());
    made.close();
    return refusal(file.path()).substr(file.path().size() + 2);
  };
  EXPECT_EQ(with_root([](formats::hdf5::Group&) {}),
            "is an HDF5 file of another kind, expected a gewebe stiffness store");
  EXPECT_EQ(with_root([](formats::hdf5::Group& root) { root.set("format", "gewebe results"); }),
            "is a gewebe results, expected a gewebe stiffness store");
  EXPECT_EQ(with_root([](formats::hdf5::Group& root) {
              root.set("format", "gewebe stiffness store");
              root.set("version", std::int64_t{2});
            }),
            "is of version 2, expected 1");
  EXPECT_EQ(with_root([](formats::hdf5::Group& root) {
              root.set("format", "gewebe stiffness store");
              root.set("version", "1");
            }),
            "'/': attribute version is not what was expected: 1 int64");
  EXPECT_EQ(with_root([](formats::hdf5::Group& root) {
              root.set("format", "gewebe stiffness store");
              root.set("version", std::int64_t{1});
              root.create_group("liver").set("name", "liver");
            }),
            "'/liver': no attribute hash, expected uint64");
}

TEST(Store, EveryBeginningOfAFileIsRefused) {
  for (const double compressed : {0.0, 1e-3}) {
    const ScratchFile file(".h5");
    write_store(file.path(), small_model(), {1}, false, 1, compressed);
    const Bytes whole = bytes_of(file.path());
    EXPECT_NO_THROW(contents(formats::StiffnessStore(whole, "whole")));
    for (std::size_t size = 0; size < whole.size(); size += size < 128 ? 1 : 97)
      EXPECT_THROW(contents(formats::StiffnessStore(std::span(whole.data(), size), "cut")), Error)
          << size;
    EXPECT_THROW(
        contents(formats::StiffnessStore(std::span(whole.data(), whole.size() - 1), "cut")), Error);
  }
}

TEST(Store, EveryFlippedBitIsFoundOrHarmless) {
  for (const double compressed : {0.0, 1e-3}) {
    const ScratchFile file(".h5");
    write_store(file.path(), small_model(), {1}, false, 1, compressed);
    Bytes bytes = bytes_of(file.path());
    const std::vector<double> expected = contents(formats::StiffnessStore(bytes, "whole"));
    std::size_t refused = 0, tried = 0;
    for (std::size_t i = 0; i < bytes.size(); i += 7) {
      const auto bit = static_cast<std::uint8_t>(1U << (i % 8));
      bytes[i] ^= bit;
      ++tried;
      try {
        EXPECT_EQ(contents(formats::StiffnessStore(bytes, "flipped")), expected) << i;
      } catch (const Error&) {
        ++refused;
      }
      bytes[i] ^= bit;
    }
    // The rest lies between the arrays and in the bounds, which are not read here.
    EXPECT_GT(refused, tried * 3 / 4);
    EXPECT_EQ(contents(formats::StiffnessStore(bytes, "whole")), expected);
  }
}

TEST(Store, ArraysOfOtherSizesAreRefused) {
  const model::Model model = small_model();
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const ScratchFile file(".h5");
  const auto write = [&](auto&& spoil) {
    formats::StiffnessFacts facts;
    facts.object = "x";
    facts.hash = formats::stiffness_hash(model);
    facts.nodes = model.nodes.size();
    facts.order = k.order();
    facts.norm = facts.condition = 1;
    spoil(facts);
    const linalg::Factor factor(k, {});
    formats::Output output(file.path(), {});
    formats::StiffnessStoreWriter writer(output);
    writer.begin(facts, k, factor, {});
    writer.end(0);
    writer.close();
    output.commit();
    return refusal(file.path());
  };
  EXPECT_EQ(write([](formats::StiffnessFacts&) {}), "accepted");
  EXPECT_NE(write([](formats::StiffnessFacts& f) { ++f.order; }).find("has shape"),
            std::string::npos);
  EXPECT_NE(write([](formats::StiffnessFacts& f) { f.order = 0; }).find("its order"),
            std::string::npos);
  EXPECT_NE(write([](formats::StiffnessFacts& f) { f.nodes = 3; }).find("its order"),
            std::string::npos);
  EXPECT_NE(write([](formats::StiffnessFacts& f) { f.nodes = 4; }).find("its axes"),
            std::string::npos);
  EXPECT_NE(
      write([](formats::StiffnessFacts& f) { f.nodes = UINT64_MAX; }).find("its number of nodes"),
      std::string::npos);
  EXPECT_NE(write([](formats::StiffnessFacts& f) { f.norm = NAN; }).find("its norm"),
            std::string::npos);
  EXPECT_NE(write([](formats::StiffnessFacts& f) { f.condition = -1; }).find("its condition"),
            std::string::npos);
}

TEST(Store, LeavesNoFileWhereAColumnDoesNotFit) {
  // Displacements beyond float32: a model so soft that 1 / k exceeds 3e38.
  model::Model model = small_model();
  for (model::Spring& s : model.springs)
    s.stiffness *= 1e-60;
  const ScratchFile file(".h5");
  (void)std::remove(file.path().c_str());
  EXPECT_THROW(write_store(file.path(), model, {1}, true), Error);
  EXPECT_FALSE(std::ifstream(file.path()).good());
}

TEST(Hdf5, KeepsTextsNumbersAndGrowingArrays) {
  const ScratchFile file(".h5");
  const std::vector<float> frame{1, 2, 3, 4, 5, 6};
  const std::vector<std::int64_t> list{4, -5};
  {
    formats::hdf5::File made = formats::hdf5::File::create(file.path());
    formats::hdf5::Group group = made.root().create_group(formats::hdf5::link_name("a/b"));
    group.set("empty", "");
    group.set("text", "Leber, außen");
    group.set("list", std::span<const std::int64_t>(list));
    group.write_texts("names", {"one", "", "three"});
    formats::hdf5::Dataset grown =
        group.create_growing("frames", formats::hdf5::Number::float32, {2, 3});
    for (int i = 0; i < 5; ++i)
      grown.append(std::span<const float>(frame));
    EXPECT_THROW(grown.append(std::span<const float>(frame.data(), 5)), Error);
    formats::hdf5::Dataset place =
        group.create_dataset("place", formats::hdf5::Number::float32, {3, 2, 3});
    place.write_rows(1, std::span<const float>(frame));
    EXPECT_THROW(place.write_rows(3, std::span<const float>(frame)), Error);
    made.close();
  }
  const formats::hdf5::File read = formats::hdf5::File::open(file.path());
  EXPECT_EQ(read.root().groups(), std::vector<std::string>{"a_b"});
  const formats::hdf5::Group group = read.root().group("a_b");
  EXPECT_EQ(group.text("empty"), "");
  EXPECT_EQ(group.text("text"), "Leber, außen");
  EXPECT_EQ(group.numbers<std::int64_t>("list", 2), list);
  EXPECT_THROW((void)group.numbers<std::int64_t>("list", 3), Error);
  EXPECT_THROW((void)group.numbers<double>("list", 2), Error);
  EXPECT_EQ(group.read_texts("names"), (std::vector<std::string>{"one", "", "three"}));
  const formats::hdf5::Dataset grown = group.dataset("frames", formats::hdf5::Number::float32);
  EXPECT_EQ(grown.shape(), (formats::hdf5::Shape{5, 2, 3}));
  std::vector<float> back(6);
  grown.read_rows(4, std::span<float>(back));
  EXPECT_EQ(back, frame);
  group.dataset("place", formats::hdf5::Number::float32).read_rows(0, std::span<float>(back));
  EXPECT_EQ(back, std::vector<float>(6));
  EXPECT_FALSE(group.has("none"));
  EXPECT_FALSE(group.has("../a_b"));
  EXPECT_THROW((void)group.dataset("frames", formats::hdf5::Number::float64), Error);
}
