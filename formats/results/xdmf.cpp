#include "formats/results/xdmf_internal.h"

#include "formats/results/result_groups_internal.h"
#include "text/number_text.h"

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::formats {

namespace {

/// Pieces of the text.
class XdmfText {
public:
  /// \param file the HDF5 file's name, without folder
  explicit XdmfText(const std::string& file);

  /// A whole array; `type` has its attributes NumberType and Precision.
  std::string array(const std::string& path, const std::string& dimensions, const char* type) const;
  /// One of the `count` rows of an array of floats of `bytes` bytes; its shape is `dimensions`, one
  /// or two numbers.
  std::string row(const std::string& path, std::uint64_t row, std::uint64_t count,
                  const std::string& dimensions, int bytes = 4) const;
  /// The same as a dataset of its own, see frame_view_name. `frames` is the path of its group.
  std::string view(const std::string& frames, const char* set, std::uint64_t row,
                   const std::string& dimensions) const;
  /// The same as an attribute. `type` is "Vector", say, `center` "Node", "Cell" or "Grid".
  static std::string attribute(const char* name, const char* type, const char* center,
                               const std::string& row);
  std::string topology(const char* type, const std::string& path, std::uint64_t count,
                       std::uint64_t nodes) const;

private:
  std::string file_; ///< with characters escaped for XML
};

XdmfText::XdmfText(const std::string& file) {
  for (const char c : file)
    switch (c) {
    case '&':
      file_ += "&amp;";
      break;
    case '<':
      file_ += "&lt;";
      break;
    case '>':
      file_ += "&gt;";
      break;
    default:
      file_ += c;
    }
}

std::string XdmfText::array(const std::string& path, const std::string& dimensions,
                            const char* type) const {
  return "<DataItem Format=\"HDF\" Dimensions=\"" + dimensions + "\" " + type + ">" + file_ + ":" +
         path + "</DataItem>\n";
}

std::string XdmfText::row(const std::string& path, std::uint64_t row, std::uint64_t count,
                          const std::string& dimensions, int bytes) const {
  const bool two = dimensions.find(' ') != std::string::npos;
  const std::string type = "NumberType=\"Float\" Precision=\"" + std::to_string(bytes) + "\"";
  return "<DataItem ItemType=\"HyperSlab\" Dimensions=\"" + dimensions +
         "\">\n<DataItem Format=\"XML\" Dimensions=\"3 " + (two ? "3" : "2") + "\">" +
         std::to_string(row) + (two ? " 0 0 1 1 1 1 " : " 0 1 1 1 ") + dimensions +
         "</DataItem>\n" + array(path, std::to_string(count) + " " + dimensions, type.c_str()) +
         "</DataItem>\n";
}

std::string XdmfText::view(const std::string& frames, const char* set, std::uint64_t row,
                           const std::string& dimensions) const {
  return array(frames + "/" + frame_view_name(set, row), dimensions,
               R"(NumberType="Float" Precision="4")");
}

std::string XdmfText::attribute(const char* name, const char* type, const char* center,
                                const std::string& row) {
  return std::string("<Attribute Name=\"") + name + "\" AttributeType=\"" + type + "\" Center=\"" +
         center + "\">\n" + row + "</Attribute>\n";
}

std::string XdmfText::topology(const char* type, const std::string& path, std::uint64_t count,
                               std::uint64_t nodes) const {
  const std::string n = std::to_string(count);
  return std::string("<Topology TopologyType=\"") + type + "\" NumberOfElements=\"" + n + "\">\n" +
         array(path, n + " " + std::to_string(nodes), R"(NumberType="UInt" Precision="4")") +
         "</Topology>\n";
}

/// Elements and displacements of an object in some frames.
struct Shape {
  std::string path;
  std::uint64_t first = 0, rows = 0; ///< frames
  std::uint64_t nodes = 0, triangles = 0, tetrahedra = 0;
  bool quadratic = false;
  bool views = false;                             ///< of each row, see frame_view_name
  std::uint64_t first_fields = 0, field_rows = 0; ///< frames with fields
};

struct Object {
  std::string name;
  std::vector<Shape> shapes;
};

struct Surface {
  std::string path;
  std::uint64_t first = 0, rows = 0; ///< frames
  std::uint64_t points = 0, triangles = 0;
};

struct Instrument {
  std::string name;
  std::uint64_t first = 0, rows = 0; ///< frames
  std::vector<Surface> surfaces;
};

std::uint64_t first_frame(const hdf5::Group& group) {
  return group.has_attribute("first_frame") ? group.number<std::uint64_t>("first_frame") : 0;
}

Shape read_shape(const hdf5::Group& group) {
  using hdf5::Number;
  Shape shape;
  shape.path = group.name();
  shape.first = first_frame(group);
  shape.rows = group.dataset("displacement", Number::float32).rows();
  shape.nodes = group.dataset("points", Number::float64).rows();
  shape.triangles = group.dataset("triangles", Number::uint32).rows();
  if (group.has("tetrahedra")) {
    const hdf5::Dataset tetrahedra = group.dataset("tetrahedra", Number::uint32);
    shape.tetrahedra = tetrahedra.rows();
    shape.quadratic = tetrahedra.row_size() == 10;
  }
  shape.views = group.has("frames");
  if (group.has("fields")) {
    const hdf5::Group fields = group.group("fields");
    shape.first_fields = first_frame(fields);
    shape.field_rows = fields.dataset("von_mises", Number::float32).rows();
  }
  return shape;
}

/// Groups "1", "2", ... in `group`.
template <class Work>
void for_numbered(const hdf5::Group& group, const Work& work) {
  for (std::uint64_t k = 1; group.has(std::to_string(k)); ++k)
    work(group.group(std::to_string(k)));
}

std::vector<Object> read_objects(const hdf5::Group& objects) {
  std::vector<Object> read;
  for (const std::string& name : ordered_names(objects)) {
    const hdf5::Group group = objects.group(name);
    Object object{name, {read_shape(group)}};
    if (group.has("cuts"))
      for_numbered(group.group("cuts"),
                   [&](const hdf5::Group& cut) { object.shapes.push_back(read_shape(cut)); });
    read.push_back(std::move(object));
  }
  return read;
}

std::vector<Instrument> read_instruments(const hdf5::Group& root) {
  using hdf5::Number;
  std::vector<Instrument> read;
  if (!root.has("instruments"))
    return read;
  const hdf5::Group instruments = root.group("instruments");
  for (const std::string& name : ordered_names(instruments)) {
    const hdf5::Group group = instruments.group(name);
    Instrument instrument{
        name, first_frame(group), group.dataset("kind", Number::uint8).rows(), {}};
    for_numbered(group.group("surfaces"), [&](const hdf5::Group& surface) {
      const hdf5::Dataset points = surface.dataset("points", Number::float32);
      instrument.surfaces.push_back({surface.name(), first_frame(surface), points.rows(),
                                     points.row_size() / 3,
                                     surface.dataset("triangles", Number::uint32).rows()});
    });
    read.push_back(std::move(instrument));
  }
  return read;
}

std::string time_text(double time) {
  return "<Time Value=\"" + gewebe::text::number_text(time) + "\"/>\n";
}

/// Whether each frame is one mesh, and each of its arrays a dataset: for meshio and others that
/// know no collection of grids and no part of a dataset.
bool is_one_mesh(const std::vector<Object>& objects, const std::vector<Instrument>& instruments) {
  return objects.size() == 1 && instruments.empty() && objects.front().shapes.front().first == 0 &&
         std::ranges::all_of(objects.front().shapes, &Shape::views);
}

/// \param time of a grid that is a frame by itself, and not one of several in a frame
std::string object_grid(const XdmfText& xdmf, const Object& object, std::uint64_t frame,
                        const std::optional<double>& time) {
  std::size_t which = 0;
  while (which + 1 < object.shapes.size() && object.shapes[which + 1].first <= frame)
    ++which;
  const Shape& shape = object.shapes[which];
  const std::string& group = shape.path;
  const std::string n = std::to_string(shape.nodes);
  const auto row = [&](const std::string& of, const char* set, std::uint64_t at, std::uint64_t rows,
                       const std::string& dimensions) {
    return time ? xdmf.view(group + "/frames", set, at, dimensions)
                : xdmf.row(of + "/" + set, at, rows, dimensions);
  };
  std::string text =
      "<Grid Name=\"" + object.name + "\" GridType=\"Uniform\">\n" + (time ? time_text(*time) : "");
  if (shape.tetrahedra > 0) { // nodes are in VTK's order, which is that of its reader
    text += xdmf.topology(shape.quadratic ? "Tetrahedron_10" : "Tetrahedron", group + "/tetrahedra",
                          shape.tetrahedra, shape.quadratic ? 10 : 4);
    text += "<Attribute Name=\"material\" AttributeType=\"Scalar\" Center=\"Cell\">\n" +
            xdmf.array(group + "/tetrahedron_material", std::to_string(shape.tetrahedra),
                       R"(NumberType="Int" Precision="4")") +
            "</Attribute>\n";
  } else if (shape.triangles > 0) {
    text += xdmf.topology("Triangle", group + "/triangles", shape.triangles, 3);
  } else {
    text += "<Topology TopologyType=\"Polyvertex\" NumberOfElements=\"" + n + "\"/>\n";
  }
  text +=
      "<Geometry GeometryType=\"XYZ\">\n" +
      xdmf.array(group + "/points", n + " 3", R"(NumberType="Float" Precision="8")") +
      "</Geometry>\n" +
      XdmfText::attribute("displacement", "Vector", "Node",
                          row(group, "displacement", frame - shape.first, shape.rows, n + " 3"));
  if (shape.field_rows > 0 && frame >= shape.first_fields) {
    const auto field = [&](const char* name, const char* set, bool tensor, bool of_nodes) {
      const std::string count = of_nodes ? n : std::to_string(shape.tetrahedra);
      text += XdmfText::attribute(name, tensor ? "Tensor6" : "Scalar", of_nodes ? "Node" : "Cell",
                                  row(group + "/fields", set, frame - shape.first_fields,
                                      shape.field_rows, tensor ? count + " 6" : count));
    };
    field("stress", "stress", true, true);
    field("strain", "strain", true, true);
    field("von_mises", "von_mises", false, true);
    field("element_stress", "element_stress", true, false);
    field("element_strain", "element_strain", true, false);
    field("element_von_mises", "element_von_mises", false, false);
  }
  text += "</Grid>\n";
  return text;
}

/// Nothing while it is not in the scene.
std::string instrument_grid(const XdmfText& xdmf, const Instrument& of, std::uint64_t frame) {
  std::string text;
  for (const Surface& surface : of.surfaces) {
    if (frame < surface.first || frame >= surface.first + surface.rows)
      continue;
    const auto number = [&](const char* name, const char* type, const char* dimensions) {
      return XdmfText::attribute(name, type, "Grid",
                                 xdmf.row("/instruments/" + of.name + "/" + name, frame - of.first,
                                          of.rows, dimensions, 8));
    };
    text += "<Grid Name=\"instrument " + of.name + "\" GridType=\"Uniform\">\n" +
            xdmf.topology("Triangle", surface.path + "/triangles", surface.triangles, 3) +
            "<Geometry GeometryType=\"XYZ\">\n" +
            xdmf.row(surface.path + "/points", frame - surface.first, surface.rows,
                     std::to_string(surface.points) + " 3") +
            "</Geometry>\n" + number("force", "Vector", "3") + number("torque", "Vector", "3") +
            "</Grid>\n";
  }
  return text;
}

} // namespace

void write_xdmf(const hdf5::File& result, const std::string& name,
                const std::function<void(std::string_view)>& write) {
  const hdf5::Group& root = result.root();
  const hdf5::Dataset time = root.dataset("time", hdf5::Number::float64);
  std::vector<double> times(time.rows());
  time.read_rows(0, std::span<double>(times));
  const std::vector<Object> objects = read_objects(root.group("objects"));
  const std::vector<Instrument> instruments = read_instruments(root);
  const XdmfText xdmf(name);
  const bool one = is_one_mesh(objects, instruments);
  write("<?xml version=\"1.0\" ?>\n<Xdmf Version=\"3.0\">\n<Domain>\n"
        "<Grid Name=\"run\" GridType=\"Collection\" CollectionType=\"Temporal\">\n");
  for (std::uint64_t f = 0; f < times.size(); ++f) {
    if (one) {
      write(object_grid(xdmf, objects.front(), f, times[f]));
      continue;
    }
    write("<Grid Name=\"scene\" GridType=\"Collection\" CollectionType=\"Spatial\">\n" +
          time_text(times[f]));
    for (const Object& object : objects)
      if (object.shapes.front().first <= f)
        write(object_grid(xdmf, object, f, std::nullopt));
    for (const Instrument& instrument : instruments)
      write(instrument_grid(xdmf, instrument, f));
    write("</Grid>\n");
  }
  write("</Grid>\n</Domain>\n</Xdmf>\n");
}

std::string frame_view_name(const std::string& set, std::uint64_t row) {
  return set.substr(set.find_last_of('/') + 1) + "_" + std::to_string(row);
}

std::string xdmf_path(const std::string& path) {
  const std::size_t slash = path.find_last_of('/') + 1; // 0 if there is none
  const std::size_t dot = path.find_last_of('.');
  return (dot == std::string::npos || dot <= slash ? path : path.substr(0, dot)) + ".xdmf";
}

std::uint64_t xdmf_bytes(const std::string& file, const std::string& object, bool fields) {
  // Of fixed words, numbers of up to 10 digits, and names; each & of the file's name may be &amp;.
  const std::uint64_t names = 5 * file.size() + object.size() + 40;
  return 1600 + 6 * names + (fields ? 6 * (420 + names) : 0);
}

} // namespace gewebe::formats
