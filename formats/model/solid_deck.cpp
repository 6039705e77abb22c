#include "formats/model/solid_deck.h"

#include "base/error.h"
#include "formats/stream/pieces.h"
#include "text/limited_text.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
// Based on: Abaqus Keywords Guide; FEBio User Manual 4.0, "Free format input".

namespace gewebe::formats {
namespace {

constexpr std::array<std::pair<std::uint8_t, char>, 3> axes{
    {{model::fixed_x, 'x'}, {model::fixed_y, 'y'}, {model::fixed_z, 'z'}}};

/// Calls put(number from 1) for each node of an element.
template <class Put>
void for_nodes(const model::Model& model, std::size_t element, const Put& put) {
  for (const std::uint32_t node : model.tetrahedra[element])
    put(std::uint64_t{node} + 1);
  if (!model.middles.empty())
    for (const std::uint32_t node : model.middles[element])
      put(std::uint64_t{node} + 1);
}

std::vector<std::size_t> elements_of(const model::Model& model, std::size_t material) {
  std::vector<std::size_t> elements;
  for (std::size_t t = 0; t < model.tetrahedra.size(); ++t)
    if (static_cast<std::size_t>(model.tetrahedron_material[t]) == material)
      elements.push_back(t);
  return elements;
}

void require_solid(const Output& output, const model::Model& model, Kind kind) {
  const std::string format(kind_name(kind));
  if (model.tetrahedra.empty())
    throw Error(output.name(), "a net of springs for " + format + ", expected a solid (--solid)");
  if (!model.springs.empty())
    throw Error(output.name(), std::to_string(model.springs.size()) + " springs of a solid for " +
                                   format + ", which this writer has not, expected none");
  for (const model::Material& material : model.materials) {
    if (!material.prony.empty())
      throw Error(output.name(), "material '" + material.name +
                                     "' has a Prony series, expected none for " + format);
    if (material.law &&
        (kind == Kind::inp || material.law->kind != model::HyperelasticLaw::neo_hookean))
      throw Error(
          output.name(),
          "material '" + material.name + "' has the law " +
              std::string(model::law_name(material.law->kind)) + ", expected " +
              (kind == Kind::inp ? "none for inp" : "classical-neo-hookean or none for feb"));
  }
}

/// A name of letters, digits, '_' and '-', with the material's number, so that names differ.
std::string plain_name(const model::Model& model, std::size_t material) {
  std::string name;
  for (const char c : model.materials[material].name)
    name += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ? c : '_';
  return name + "-" + std::to_string(material);
}

/// Abaqus and CalculiX read 20 characters of a number.
std::string number(double value) {
  constexpr std::size_t most = 20;
  return gewebe::text::limited_text(value, most);
}

void write_inp(Pieces& out, const model::Model& model) {
  out << "*HEADING\nUnits: mm, g, s, Pa; forces in 1e-6 N\n*NODE, NSET=NALL\n";
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    const Vec3& p = model.nodes[n].position;
    out << n + 1 << ", " << number(p.x) << ", " << number(p.y) << ", " << number(p.z) << "\n";
  }
  const char* const type = model.middles.empty() ? "C3D4" : "C3D10";
  for (std::size_t m = 0; m < model.materials.size(); ++m) {
    const std::vector<std::size_t> elements = elements_of(model, m);
    if (elements.empty())
      continue;
    out << "*ELEMENT, TYPE=" << type << ", ELSET=MATERIAL-" << m << "\n";
    for (const std::size_t t : elements) {
      out << t + 1;
      for_nodes(model, t, [&](std::uint64_t node) { out << ", " << node; });
      out << "\n";
    }
  }
  for (std::size_t m = 0; m < model.materials.size(); ++m) {
    const model::Material& material = model.materials[m];
    if (elements_of(model, m).empty())
      continue;
    const std::string name = plain_name(model, m);
    out << "*MATERIAL, NAME=" << name << "\n*ELASTIC\n"
        << number(material.young) << ", " << number(material.poisson.value_or(0)) << "\n*DENSITY\n"
        << number(material.density) << "\n*SOLID SECTION, ELSET=MATERIAL-" << m
        << ", MATERIAL=" << name << "\n";
  }
  bool any = false;
  for (std::size_t n = 0; n < model.nodes.size(); ++n)
    for (std::size_t axis = 0; axis < axes.size(); ++axis)
      if ((model.nodes[n].fixed & axes[axis].first) != 0) {
        out << (any ? "" : "*BOUNDARY\n") << n + 1 << ", " << axis + 1 << ", " << axis + 1 << "\n";
        any = true;
      }
}

void write_feb_mesh(Pieces& out, const model::Model& model) {
  out << "<Mesh>\n<Nodes name=\"nodes\">\n";
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    const Vec3& p = model.nodes[n].position;
    out << "<node id=\"" << n + 1 << "\">" << p.x << "," << p.y << "," << p.z << "</node>\n";
  }
  out << "</Nodes>\n";
  for (std::size_t m = 0; m < model.materials.size(); ++m) {
    const std::vector<std::size_t> elements = elements_of(model, m);
    if (elements.empty())
      continue;
    out << "<Elements type=\"" << (model.middles.empty() ? "tet4" : "tet10") << "\" name=\"part-"
        << plain_name(model, m) << "\">\n";
    for (const std::size_t t : elements) {
      out << "<elem id=\"" << t + 1 << "\">";
      bool first = true;
      for_nodes(model, t, [&](std::uint64_t node) {
        out << (std::exchange(first, false) ? "" : ",") << node;
      });
      out << "</elem>\n";
    }
    out << "</Elements>\n";
  }
  for (const auto& [axis, letter] : axes) {
    bool first = true;
    for (std::size_t n = 0; n < model.nodes.size(); ++n)
      if ((model.nodes[n].fixed & axis) != 0) {
        if (first)
          out << "<NodeSet name=\"fixed-" << std::string_view(&letter, 1) << "\">";
        out << (std::exchange(first, false) ? "" : ",") << n + 1;
      }
    if (!first)
      out << "</NodeSet>\n";
  }
  out << "</Mesh>\n";
}

bool any_fixed(const model::Model& model, std::uint8_t axis) {
  return std::ranges::any_of(model.nodes,
                             [axis](const model::Node& node) { return (node.fixed & axis) != 0; });
}

void write_feb(Pieces& out, const model::Model& model) {
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<!-- Units: mm, g, s, Pa; forces in 1e-6 N -->\n"
         "<febio_spec version=\"4.0\">\n<Module type=\"solid\"/>\n<Control>\n"
         "<analysis>STATIC</analysis>\n<time_steps>10</time_steps>\n<step_size>0.1</step_size>\n"
         "</Control>\n<Material>\n";
  for (std::size_t m = 0; m < model.materials.size(); ++m) {
    const model::Material& material = model.materials[m];
    if (elements_of(model, m).empty())
      continue;
    out << "<material id=\"" << m + 1 << "\" name=\"" << plain_name(model, m) << "\" type=\""
        << (material.law ? "neo-Hookean" : "isotropic elastic") << "\">\n<density>"
        << material.density << "</density>\n<E>" << material.young << "</E>\n<v>"
        << material.poisson.value_or(0) << "</v>\n</material>\n";
  }
  out << "</Material>\n";
  write_feb_mesh(out, model);
  out << "<MeshDomains>\n";
  for (std::size_t m = 0; m < model.materials.size(); ++m)
    if (!elements_of(model, m).empty())
      out << "<SolidDomain name=\"part-" << plain_name(model, m) << "\" mat=\""
          << plain_name(model, m) << "\"/>\n";
  out << "</MeshDomains>\n<Boundary>\n";
  for (const auto& [axis, letter] : axes)
    if (any_fixed(model, axis)) {
      const std::string_view name(&letter, 1);
      out << "<bc name=\"fixed-" << name << "\" node_set=\"fixed-" << name
          << "\" type=\"zero displacement\">";
      for (const auto& [other, of] : axes)
        out << "<" << std::string_view(&of, 1) << "_dof>" << (other == axis ? 1 : 0) << "</"
            << std::string_view(&of, 1) << "_dof>";
      out << "</bc>\n";
    }
  out << "</Boundary>\n</febio_spec>\n";
}

} // namespace

const std::vector<Kind>& solid_deck_kinds() {
  static const std::vector<Kind> kinds{Kind::inp, Kind::feb};
  return kinds;
}

void write_solid_deck(Output& output, const model::Model& model, Kind kind) {
  require_solid(output, model, kind);
  const Sink sink = [&](std::string_view piece) { output.write(piece); };
  Pieces out(sink);
  if (kind == Kind::inp)
    write_inp(out, model);
  else
    write_feb(out, model);
  out.flush();
}

} // namespace gewebe::formats
