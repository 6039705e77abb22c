#include "base/mesh.h"
#include "formats/results/grid_internal.h"

#include <algorithm>
#include <limits>

namespace gewebe::grid {

namespace {

constexpr std::array<std::size_t, 6> tensor_order{0, 3, 5, 1, 4, 2};

} // namespace

Shape shape_of(const Model& model) {
  Shape shape;
  for (const Node& node : model.nodes)
    shape.points.push_back(node.position);
  if (model.tetrahedra.empty()) {
    const TriangleMesh mesh = surface_mesh(model);
    for (const Triangle& t : mesh.triangles)
      shape.nodes.insert(shape.nodes.end(), t.begin(), t.end());
    shape.material = mesh.material;
    shape.material.resize(mesh.triangles.size());
  } else {
    shape.type = model.middles.empty() ? tetrahedron : quadratic;
    for (std::size_t t = 0; t < model.tetrahedra.size(); ++t) {
      const Tetrahedron& corners = model.tetrahedra[t];
      shape.nodes.insert(shape.nodes.end(), corners.begin(), corners.end());
      if (shape.type == quadratic)
        shape.nodes.insert(shape.nodes.end(), model.middles[t].begin(), model.middles[t].end());
    }
    shape.material = model.tetrahedron_material;
  }
  shape.displacement.resize(3 * shape.points.size());
  return shape;
}

Joined join(const std::vector<Shape>& shapes) {
  Joined all;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Shape& shape = shapes[i];
    const auto first = static_cast<std::int64_t>(all.points.size() / 3);
    for (const Vec3& p : shape.points)
      all.points.insert(all.points.end(), {p.x, p.y, p.z});
    for (const std::uint32_t node : shape.nodes)
      all.nodes.push_back(first + node);
    for (std::size_t c = 0; c < shape.cells(); ++c)
      all.ends.push_back((all.ends.empty() ? 0 : all.ends.back()) +
                         static_cast<std::int64_t>(shape.size()));
    all.types.insert(all.types.end(), shape.cells(), shape.type);
    all.object.insert(all.object.end(), shape.cells(), static_cast<std::int32_t>(i));
    all.material.insert(all.material.end(), shape.material.begin(), shape.material.end());
  }
  return all;
}

std::vector<double> displacements(const std::vector<Shape>& shapes) {
  std::vector<double> all;
  for (const Shape& shape : shapes)
    all.insert(all.end(), shape.displacement.begin(), shape.displacement.end());
  return all;
}

bool have_fields(const std::vector<Shape>& shapes) {
  return std::ranges::any_of(shapes, [](const Shape& shape) { return shape.fields.has_value(); });
}

std::vector<double> values_of(const std::vector<Shape>& shapes, const Field& field) {
  std::vector<double> values;
  for (const Shape& shape : shapes) {
    if (!shape.fields) {
      values.insert(values.end(),
                    field.components() * (field.of_cells ? shape.cells() : shape.points.size()),
                    std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    for (const SymmetricBlock& tensor : (*shape.fields).*(field.tensors))
      if (field.mises)
        values.push_back(von_mises(tensor));
      else
        for (const std::size_t k : tensor_order)
          values.push_back(tensor[k]);
  }
  return values;
}

} // namespace gewebe::grid
