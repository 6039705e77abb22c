#include "contact/instrument_surface.h"
#include "formats/results/grid_internal.h"
#include "geometry/mesh.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace gewebe::formats::grid {

namespace {

constexpr std::array<std::size_t, 6> tensor_order{0, 3, 5, 1, 4, 2};

} // namespace

Shape shape_of(const model::Model& model) {
  Shape shape;
  for (const model::Node& node : model.nodes)
    shape.points.push_back(node.position);
  if (model.tetrahedra.empty()) {
    const TriangleMesh mesh = model::surface_mesh(model);
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

void Shapes::add(const model::Model& model) {
  all_.insert(all_.begin() + static_cast<std::ptrdiff_t>(objects_++), shape_of(model));
}

void Shapes::change(std::size_t object, const model::Model& model) {
  all_.at(object) = shape_of(model);
}

void Shapes::set(std::span<const FrameObject> objects) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    Shape& shape = all_.at(i);
    shape.displacement.assign(objects[i].displacement.begin(), objects[i].displacement.end());
    shape.fields.reset();
    if (objects[i].fields != nullptr)
      shape.fields = *objects[i].fields;
  }
}

bool Shapes::set(std::span<const FrameInstrument> instruments) {
  constexpr std::size_t around = 32;
  std::vector<Instrument> there;
  for (std::size_t k = 0; k < instruments.size(); ++k)
    if (instruments[k].present && contact::shown_radius(instruments[k].shape) > 0)
      there.push_back({k, instruments[k].shape, {}});
  const bool other =
      !std::ranges::equal(there, instruments_, [](const Instrument& a, const Instrument& b) {
        return a.number == b.number && contact::same_surface(a.shape, b.shape);
      });
  if (other) {
    all_.resize(objects_);
    for (Instrument& one : there) {
      contact::InstrumentSurface made = contact::shown_surface(one.shape, around);
      one.own = std::move(made.points);
      Shape& shape = all_.emplace_back();
      shape.instrument = one.number;
      for (const Vec3& r : one.own)
        shape.points.push_back(instruments[one.number].pose(r));
      for (const Triangle& t : made.triangles)
        shape.nodes.insert(shape.nodes.end(), t.begin(), t.end());
      shape.material.assign(made.triangles.size(), -1);
    }
    instruments_ = std::move(there);
  }
  for (std::size_t n = 0; n < instruments_.size(); ++n) {
    const Instrument& one = instruments_[n];
    Shape& shape = all_[objects_ + n];
    shape.displacement.clear();
    for (std::size_t i = 0; i < one.own.size(); ++i) {
      const Vec3 u = instruments[one.number].pose(one.own[i]) - shape.points[i];
      shape.displacement.insert(shape.displacement.end(), {u.x, u.y, u.z});
    }
  }
  return other;
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
    const std::size_t number = shape.instrument.value_or(i);
    all.object.insert(all.object.end(), shape.cells(),
                      shape.instrument ? -1 - static_cast<std::int32_t>(number)
                                       : static_cast<std::int32_t>(number));
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
    for (const linalg::SymmetricBlock& tensor : (*shape.fields).*(field.tensors))
      if (field.mises)
        values.push_back(fem::von_mises(tensor));
      else
        for (const std::size_t k : tensor_order)
          values.push_back(tensor[k]);
  }
  return values;
}

} // namespace gewebe::formats::grid
