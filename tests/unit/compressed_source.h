#pragma once
// Compressed columns of a model, as a store has them.

#include "columns/column_compression.h"
#include "columns/compliance_columns.h"
#include "columns/compressed_columns.h"
#include "compliance/compliance_source.h"
#include "fem/model_stiffness.h"
#include "linalg/condition.h"
#include "linalg/factor.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {

/// Columns of every `step`-th surface node, with rows for the surface.
inline columns::CompressedMade compressed_surface(const model::Model& model, double relative,
                                                  std::size_t step = 1) {
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const linalg::Factor factor(k, {});
  const std::size_t rows = model::surface_count(model);
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < rows; ++i) {
    positions.push_back(model.nodes[i].position);
    if (i % step == 0)
      nodes.push_back(i);
  }
  return columns::compress_columns(
      positions, nodes, relative,
      [&](std::span<const std::uint32_t> of, columns::ColumnSink& sink) {
        return columns::compliance_columns(k, factor, linalg::stiffness_norm(k), of, {}, sink,
                                           rows);
      },
      {});
}

/// Of these columns. \param model  outlives the source
inline std::shared_ptr<compliance::ComplianceSource> compressed(const model::Model& model,
                                                                columns::CompressedMade made) {
  return compliance::compliance_of_store(
      {columns::compressed_columns(std::move(made), model.nodes.size()),
       [&model] { return linalg::Factor(fem::stiffness_matrix(model), Context{}); }});
}

} // namespace gewebe::test
