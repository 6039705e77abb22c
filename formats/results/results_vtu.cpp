#include "formats/results/results_vtu.h"
// Based on: VTK file formats, docs.vtk.org, "XML file formats".

#include "base/error.h"
#include "base/mesh.h"
#include "base/number_text.h"
#include "formats/results/series_internal.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace gewebe {

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Cells of VTK's types: triangles where there are no tetrahedra.
enum CellType : std::uint8_t { triangle = 5, tetrahedron = 10, quadratic = 24 };

struct Shape {
  std::vector<Vec3> points; ///< at rest
  CellType type = triangle;
  std::vector<std::uint32_t> nodes; ///< of the cells
  std::vector<std::int32_t> material;
  std::vector<double> displacement;
  std::optional<SolidFields> fields;

  std::size_t size() const { return type == triangle ? 3 : type == tetrahedron ? 4 : 10; }
  std::size_t cells() const { return nodes.size() / size(); }
};

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

/// Arrays behind the text, each with its size before it.
class Arrays {
public:
  template <class Value>
  void add(std::string& text, const char* name, std::size_t components,
           const std::vector<Value>& values) {
    const char* const type = std::is_same_v<Value, double>         ? "Float64"
                             : std::is_same_v<Value, std::int64_t> ? "Int64"
                             : std::is_same_v<Value, std::int32_t> ? "Int32"
                                                                   : "UInt8";
    text += std::string("<DataArray type=\"") + type + "\" Name=\"" + name +
            "\" NumberOfComponents=\"" + std::to_string(components) +
            "\" format=\"appended\" offset=\"" + std::to_string(bytes_.size()) + "\"/>\n";
    const std::uint64_t size = values.size() * sizeof(Value);
    bytes_.append(reinterpret_cast<const char*>(&size), sizeof size);
    bytes_.append(reinterpret_cast<const char*>(values.data()), size);
  }
  const std::string& bytes() const { return bytes_; }

private:
  std::string bytes_;
};

/// VTK's order of symmetric tensors: xx yy zz xy yz xz.
constexpr std::array<std::size_t, 6> tensor_order{0, 3, 5, 1, 4, 2};

class VtuWriter final : public ResultWriter {
public:
  VtuWriter(const std::string& path, const Output::Options& options)
      : options_(options), series_(series_in(path)) {
    options_.binary = true;
    if (!series_)
      last_.emplace(path, options_);
  }

  void add_object(const std::string& /*name*/, const Model& model) override {
    shapes_.push_back(shape_of(model));
  }
  void change_object(std::size_t object, const Model& model,
                     std::span<const std::uint32_t> /*origin*/) override {
    shapes_.at(object) = shape_of(model);
  }
  void add_frame(double time, std::span<const FrameObject> objects) override {
    time_ = time;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      Shape& shape = shapes_.at(i);
      shape.displacement.assign(objects[i].displacement.begin(), objects[i].displacement.end());
      shape.fields.reset();
      if (objects[i].fields != nullptr)
        shape.fields = *objects[i].fields;
    }
    if (!series_)
      return;
    Output output(series_->name(frame_++), options_);
    write(output);
  }
  void commit() override {
    if (last_)
      write(*last_);
  }

private:
  using Tensors = std::vector<SymmetricBlock> SolidFields::*;

  /// A field of all objects, of those that have none NaN. \param count of nodes or cells of a shape
  template <class Count>
  void add_field(Arrays& arrays, std::string& text, const char* name, Tensors tensors, bool mises,
                 const Count& count) const {
    std::vector<double> values;
    for (const Shape& shape : shapes_) {
      if (!shape.fields) {
        values.insert(values.end(), (mises ? 1 : 6) * count(shape), unknown);
        continue;
      }
      for (const SymmetricBlock& tensor : (*shape.fields).*tensors)
        if (mises)
          values.push_back(von_mises(tensor));
        else
          for (const std::size_t k : tensor_order)
            values.push_back(tensor[k]);
    }
    arrays.add(text, name, mises ? 1 : 6, values);
  }

  void write(Output& output) const {
    std::vector<double> points, displacement;
    std::vector<std::int64_t> nodes, offsets;
    std::vector<std::uint8_t> types;
    std::vector<std::int32_t> object, material;
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      const Shape& shape = shapes_[i];
      const auto first = static_cast<std::int64_t>(points.size() / 3);
      for (const Vec3& p : shape.points)
        points.insert(points.end(), {p.x, p.y, p.z});
      displacement.insert(displacement.end(), shape.displacement.begin(), shape.displacement.end());
      for (const std::uint32_t node : shape.nodes)
        nodes.push_back(first + node);
      for (std::size_t c = 0; c < shape.cells(); ++c)
        offsets.push_back((offsets.empty() ? 0 : offsets.back()) +
                          static_cast<std::int64_t>(shape.size()));
      types.insert(types.end(), shape.cells(), shape.type);
      object.insert(object.end(), shape.cells(), static_cast<std::int32_t>(i));
      material.insert(material.end(), shape.material.begin(), shape.material.end());
    }
    const bool fields =
        std::ranges::any_of(shapes_, [](const Shape& shape) { return shape.fields.has_value(); });
    Arrays arrays;
    std::string text =
        "<?xml version=\"1.0\"?>\n<!-- gewebe_results, millimetres -->\n"
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\">\n<UnstructuredGrid>\n<FieldData>\n"
        "<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">" +
        number_text(time_) + "</DataArray>\n</FieldData>\n<Piece NumberOfPoints=\"" +
        std::to_string(points.size() / 3) + "\" NumberOfCells=\"" + std::to_string(types.size()) +
        "\">\n<Points>\n";
    arrays.add(text, "Points", 3, points);
    text += "</Points>\n<Cells>\n";
    arrays.add(text, "connectivity", 1, nodes);
    arrays.add(text, "offsets", 1, offsets);
    arrays.add(text, "types", 1, types);
    text += "</Cells>\n<PointData Vectors=\"displacement\">\n";
    arrays.add(text, "displacement", 3, displacement);
    if (fields) {
      const auto count = [](const Shape& shape) { return shape.points.size(); };
      add_field(arrays, text, "stress", &SolidFields::node_stress, false, count);
      add_field(arrays, text, "strain", &SolidFields::node_strain, false, count);
      add_field(arrays, text, "von_mises", &SolidFields::node_stress, true, count);
    }
    text += "</PointData>\n<CellData Scalars=\"material\">\n";
    arrays.add(text, "material", 1, material);
    arrays.add(text, "object", 1, object);
    if (fields) {
      const auto count = [](const Shape& shape) { return shape.cells(); };
      add_field(arrays, text, "element_stress", &SolidFields::element_stress, false, count);
      add_field(arrays, text, "element_strain", &SolidFields::element_strain, false, count);
      add_field(arrays, text, "element_von_mises", &SolidFields::element_stress, true, count);
    }
    text += "</CellData>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    output.write(text);
    output.write(arrays.bytes());
    output.write("\n</AppendedData>\n</VTKFile>\n");
    output.commit();
  }

  Output::Options options_;
  std::optional<SeriesName> series_; ///< else
  std::optional<Output> last_;
  std::vector<Shape> shapes_;
  double time_ = 0;
  std::uint64_t frame_ = 0;
};

} // namespace

std::unique_ptr<ResultWriter> open_vtu_result(const std::string& path,
                                              const Output::Options& options) {
  return std::make_unique<VtuWriter>(path, options);
}

} // namespace gewebe
