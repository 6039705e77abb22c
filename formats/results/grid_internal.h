#pragma once
// All objects and instruments of a frame as one unstructured grid of VTK's, which files of several
// kinds hold.

#include "contact/instrument.h"
#include "fem/stress.h"
#include "formats/results/results_writer.h"
#include "geometry/vec3.h"
#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::formats::grid {

/// Cells of VTK's types: triangles where there are no tetrahedra.
enum CellType : std::uint8_t { triangle = 5, tetrahedron = 10, quadratic = 24 };

/// An object as it is now, or an instrument.
struct Shape {
  std::vector<Vec3> points; ///< at rest
  CellType type = triangle;
  std::vector<std::uint32_t> nodes; ///< of the cells
  std::vector<std::int32_t> material;
  std::vector<double> displacement;
  std::optional<fem::SolidFields> fields;
  std::optional<std::size_t> instrument; ///< of these

  std::size_t size() const { return type == triangle ? 3 : type == tetrahedron ? 4 : 10; }
  std::size_t cells() const { return nodes.size() / size(); }
};

/// At rest, without fields.
Shape shape_of(const model::Model& model);

/// Of objects, and behind them of instruments. An instrument stands at rest where it was when one
/// of them last came, went or got another shape.
class Shapes {
public:
  void add(const model::Model& model);
  void change(std::size_t object, const model::Model& model);
  void set(std::span<const FrameObject> objects);
  /// Whether it is another set of shapes.
  bool set(std::span<const FrameInstrument> instruments);
  const std::vector<Shape>& all() const noexcept { return all_; }

private:
  struct Instrument {
    std::size_t number = 0; ///< of all
    contact::InstrumentShape shape;
    std::vector<Vec3> own; ///< points in its own coordinates
  };
  std::vector<Shape> all_;
  std::size_t objects_ = 0;
  std::vector<Instrument> instruments_; ///< that are there
};

/// What doesn't change from frame to frame unless a shape is cut.
struct Joined {
  std::vector<double> points; ///< at rest
  std::vector<std::int64_t> nodes, ends;
  std::vector<std::uint8_t> types;
  /// Number of the object of each cell, or -1, -2, … for instruments; material, -1 for instruments.
  std::vector<std::int32_t> object, material;
};

Joined join(const std::vector<Shape>& shapes);
std::vector<double> displacements(const std::vector<Shape>& shapes);

/// Tensors of solids, or their equivalent stresses.
struct Field {
  const char* name;
  std::vector<linalg::SymmetricBlock> fem::SolidFields::*tensors;
  bool mises, of_cells;

  std::size_t components() const { return mises ? 1 : 6; }
};
inline constexpr std::array<Field, 3> node_fields{
    {{"stress", &fem::SolidFields::node_stress, false, false},
     {"strain", &fem::SolidFields::node_strain, false, false},
     {"von_mises", &fem::SolidFields::node_stress, true, false}}};
inline constexpr std::array<Field, 3> cell_fields{
    {{"element_stress", &fem::SolidFields::element_stress, false, true},
     {"element_strain", &fem::SolidFields::element_strain, false, true},
     {"element_von_mises", &fem::SolidFields::element_stress, true, true}}};

bool have_fields(const std::vector<Shape>& shapes);
/// Of all nodes or cells, NaN where a shape has none. Tensors in VTK's order: xx yy zz xy yz xz.
std::vector<double> values_of(const std::vector<Shape>& shapes, const Field& field);

} // namespace gewebe::formats::grid
