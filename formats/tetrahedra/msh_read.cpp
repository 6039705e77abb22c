#include "formats/tetrahedra/msh_internal.h"

#include <algorithm>
#include <map>
#include <optional>
// Based on: Geuzaine, Remacle, Gmsh reference manual 4.11, MSH file format, version 4.1, and
// legacy versions 1 and 2.2.

namespace gewebe::formats::tet {
namespace {

/// What an element type is to us.
struct Type {
  int number;
  std::size_t nodes;
  bool tetrahedron;
};

// Points, lines, triangles and quadrangles are passed over.
constexpr std::array<Type, 20> known{{
    {4, 4, true},    {11, 10, true},  {15, 1, false},  {1, 2, false},   {8, 3, false},
    {26, 4, false},  {27, 5, false},  {28, 6, false},  {2, 3, false},   {9, 6, false},
    {20, 9, false},  {21, 10, false}, {22, 12, false}, {23, 15, false}, {24, 15, false},
    {25, 21, false}, {3, 4, false},   {10, 9, false},  {16, 8, false},  {36, 16, false},
}};

std::string refused_name(std::int64_t type) {
  switch (type) {
  case 5:
  case 12:
  case 17:
    return "hexahedra";
  case 6:
  case 13:
  case 18:
    return "prisms";
  case 7:
  case 14:
  case 19:
    return "pyramids";
  case 29:
  case 30:
  case 31:
    return "tetrahedra of over 10 nodes";
  default:
    return "elements of type " + std::to_string(type);
  }
}

/// The tags of nodes, and where each stands among them.
class NodeTags {
public:
  void reserve(std::size_t count) { tags_.reserve(count); }
  void add(std::uint64_t tag) { tags_.push_back(tag); }
  std::size_t size() const { return tags_.size(); }

  /// To be called before `find`; the tag that stands twice, if one does.
  std::optional<std::uint64_t> sort() {
    consecutive_ = true;
    for (std::size_t n = 1; n < tags_.size() && consecutive_; ++n)
      consecutive_ = tags_[n] == tags_[0] + n;
    if (consecutive_)
      return std::nullopt;
    sorted_.reserve(tags_.size());
    for (std::size_t n = 0; n < tags_.size(); ++n)
      sorted_.emplace_back(tags_[n], static_cast<std::uint32_t>(n));
    std::sort(sorted_.begin(), sorted_.end());
    for (std::size_t n = 1; n < sorted_.size(); ++n)
      if (sorted_[n].first == sorted_[n - 1].first)
        return sorted_[n].first;
    return std::nullopt;
  }

  std::optional<std::uint32_t> find(std::uint64_t tag) const {
    if (tags_.empty())
      return std::nullopt;
    if (consecutive_) {
      if (tag < tags_[0] || tag - tags_[0] >= tags_.size())
        return std::nullopt;
      return static_cast<std::uint32_t>(tag - tags_[0]);
    }
    const auto at = std::lower_bound(sorted_.begin(), sorted_.end(), std::pair(tag, 0U));
    if (at == sorted_.end() || at->first != tag)
      return std::nullopt;
    return at->second;
  }

private:
  std::vector<std::uint64_t> tags_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted_;
  bool consecutive_ = false;
};

class MshReader {
public:
  MshReader(std::string_view bytes, const std::string& name, TetReadStats& stats)
      : in_(bytes, name), stats_(stats) {}

  tetrahedra::TetMesh read() {
    for (std::string_view section = in_.words().word(); !section.empty();
         section = in_.words().word())
      read_section(section);
    if (!has_format_)
      in_.words().fail("no Gmsh mesh, expected $MeshFormat or $NOD");
    if (!has_nodes_ || !has_elements_)
      in_.words().fail(std::string("the file ends without ") +
                       (version1_    ? has_nodes_ ? "$ELM" : "$NOD"
                        : has_nodes_ ? "$Elements"
                                     : "$Nodes") +
                       ", expected them");
    return finish();
  }

private:
  void read_section(std::string_view section) {
    if (version1_ && section != "$NOD" && section != "$ELM")
      in_.words().fail(quoted(section) + " in a file of version 1, expected $NOD or $ELM");
    if (section[0] != '$' || section.size() < 2)
      in_.words().fail(quoted(section) + ", expected a section, such as $Nodes");
    const std::string end = "$End" + std::string(section.substr(1));
    if (section == "$NOD" || section == "$ELM")
      return read_section1(section);
    if (section == "$Comments") {
      in_.skip_to(end);
    } else if (section == "$MeshFormat") {
      in_.read_format();
      has_format_ = true;
    } else if (!has_format_) {
      in_.words().fail(std::string(section) + " before $MeshFormat, expected that first");
    } else if (section == "$Nodes") {
      if (has_nodes_)
        in_.words().fail("a second $Nodes, expected one");
      has_nodes_ = true;
      in_.end_of_line();
      if (in_.version() == 2)
        read_nodes2();
      else
        read_nodes4();
      if (const auto twice = tags_.sort())
        in_.words().fail("two nodes of number " + std::to_string(*twice) + ", expected one");
    } else if (section == "$Elements") {
      if (!has_nodes_)
        in_.words().fail("$Elements before $Nodes, expected $Nodes first");
      has_elements_ = true;
      in_.end_of_line();
      if (in_.version() == 2)
        read_elements2();
      else
        read_elements4();
    } else if (section == "$Entities" && in_.version() == 4) {
      in_.end_of_line();
      read_entities();
    } else if (section == "$PhysicalNames") {
      read_names();
    } else if (section == "$PartitionedEntities") {
      in_.words().fail("a mesh in partitions, expected it in one");
    } else {
      in_.skip_to(end);
      return;
    }
    if (section != "$Comments" && in_.words().word() != end)
      in_.words().fail("expected " + end);
  }

  /// Version 1 has text without $MeshFormat.
  void read_section1(std::string_view section) {
    const bool nodes = section == "$NOD";
    if (has_format_ && !version1_)
      in_.words().fail(std::string(section) + " of version 1 behind $MeshFormat, expected " +
                       (nodes ? "$Nodes" : "$Elements"));
    if (nodes ? has_nodes_ : has_elements_)
      in_.words().fail("a second " + std::string(section) + ", expected one");
    if (!nodes && !has_nodes_)
      in_.words().fail("$ELM before $NOD, expected $NOD first");
    has_format_ = version1_ = true;
    (nodes ? has_nodes_ : has_elements_) = true;
    if (nodes) {
      read_nodes2(); // the same lines
      if (const auto twice = tags_.sort())
        in_.words().fail("two nodes of number " + std::to_string(*twice) + ", expected one");
    } else {
      read_elements1();
    }
    const std::string end = nodes ? "$ENDNOD" : "$ENDELM";
    if (in_.words().word() != end)
      in_.words().fail("expected " + end);
  }

  void read_elements1() {
    const std::uint64_t elements = in_.words().count("the number of elements");
    in_.words().require(elements, 6, "elements");
    for (std::uint64_t n = 0; n < elements; ++n) {
      in_.words().count("an element's number");
      const Type& type = type_of(in_.words().integer("a type"));
      const std::int64_t physical = in_.integer("a physical region"),
                         entity = in_.integer("an elementary region");
      if (const std::uint64_t nodes = in_.words().count("the number of nodes"); nodes != type.nodes)
        in_.words().fail(std::to_string(nodes) + " nodes of an element of type " +
                         std::to_string(type.number) + ", expected " + std::to_string(type.nodes));
      add_element(type, physical, entity);
    }
  }

  /// Always text. Only one of the names matters.
  void read_names() {
    const std::uint64_t names = in_.words().count("the number of names");
    in_.words().require(names, 3, "names");
    for (std::uint64_t n = 0; n < names; ++n) {
      const std::int64_t dimension = in_.words().integer("a dimension"),
                         group = in_.words().integer("a physical group");
      const std::string_view name = in_.words().line();
      const std::size_t at = name.find('"');
      if (at == std::string_view::npos)
        in_.words().fail("expected a name in quotes");
      if (dimension == 3 && name.substr(at + 1).starts_with(name_of_0) &&
          name.substr(at + 1 + name_of_0.size()).starts_with('"'))
        group_of_0_ = group;
    }
  }

  // ---- Nodes

  void add_node(std::uint64_t tag) {
    const double x = in_.real("x"), y = in_.real("y"), z = in_.real("z");
    tags_.add(tag);
    result_.mesh.points.push_back({x, y, z});
  }

  void read_nodes2() {
    const std::uint64_t nodes = in_.words().count("the number of nodes");
    in_.end_of_line();
    in_.require(nodes, 4, 28, "nodes");
    tags_.reserve(nodes);
    result_.mesh.points.reserve(nodes);
    for (std::uint64_t n = 0; n < nodes; ++n)
      add_node(in_.count("a node's number"));
  }

  void read_nodes4() {
    const std::uint64_t blocks = in_.count("the number of blocks");
    in_.count("the number of nodes"); // Gmsh counts those that entities share several times
    in_.count("the least number");
    in_.count("the largest number");
    in_.require(blocks, 4, 20, "blocks of nodes");
    std::vector<std::uint64_t> tags;
    for (std::uint64_t b = 0; b < blocks; ++b) {
      const std::int64_t dimension = in_.integer("a dimension");
      in_.integer("an entity's number");
      const std::int64_t parametric = in_.integer("0 or 1");
      if (dimension < 0 || dimension > 3 || parametric < 0 || parametric > 1)
        in_.fail("a block of nodes of dimension " + std::to_string(dimension) +
                 ", expected 0 to 3, then 0 or 1");
      const std::uint64_t size = in_.count("the number of nodes");
      in_.require(size, 4, 32, "nodes");
      tags.clear();
      for (std::uint64_t n = 0; n < size; ++n)
        tags.push_back(in_.count("a node's number"));
      for (const std::uint64_t tag : tags) {
        add_node(tag);
        for (std::int64_t u = 0; u < dimension * parametric; ++u)
          in_.real("a parameter");
      }
    }
  }

  // ---- Elements

  const Type& type_of(std::int64_t number) const {
    for (const Type& type : known)
      if (type.number == number)
        return type;
    in_.fail(refused_name(number) + ", expected tetrahedra of 4 or 10 nodes");
  }

  /// Reads the nodes of an element and keeps it if it is a tetrahedron.
  void add_element(const Type& type, std::int64_t physical, std::int64_t entity) {
    if (!type.tetrahedron) {
      for (std::size_t k = 0; k < type.nodes; ++k)
        in_.count("a node");
      ++stats_.skipped_elements;
      return;
    }
    std::array<std::uint32_t, 10> nodes{};
    for (std::size_t k = 0; k < type.nodes; ++k) {
      const std::uint64_t tag = in_.count("a node");
      const auto index = tags_.find(tag);
      if (!index)
        in_.fail("an element with node " + std::to_string(tag) + ", which is not there");
      nodes[k] = *index;
    }
    std::swap(nodes[8], nodes[9]); // Gmsh's edge 23 comes before 13
    result_.add(std::span(nodes).first(type.nodes), 0,
                [&](const std::string& what) { in_.fail(what); });
    physical_.push_back(physical);
    entity_.push_back(entity);
  }

  /// Reads the tags of an element of version 2, and what they are.
  std::pair<std::int64_t, std::int64_t> tags2(std::uint64_t size) {
    std::pair<std::int64_t, std::int64_t> tags{0, 0};
    for (std::uint64_t k = 0; k < size; ++k) {
      const std::int64_t tag = in_.integer("a tag");
      if (k < 2)
        (k == 0 ? tags.first : tags.second) = tag;
    }
    return tags;
  }

  void read_elements2() {
    const std::uint64_t elements = in_.words().count("the number of elements");
    in_.end_of_line();
    in_.require(elements, 4, 8, "elements");
    for (std::uint64_t n = 0; n < elements;) {
      if (!in_.binary()) {
        in_.words().count("an element's number");
        const Type& type = type_of(in_.words().integer("a type"));
        const std::uint64_t size = in_.words().count("the number of tags");
        in_.words().require(size, 1, "tags");
        const auto [physical, entity] = tags2(size);
        add_element(type, physical, entity);
        ++n;
        continue;
      }
      const Type& type = type_of(in_.integer("a type"));
      const std::uint64_t follow = in_.count("the number of elements"),
                          size = in_.count("a number of tags");
      if (follow == 0 || follow > elements - n)
        in_.fail(std::to_string(follow) + " elements of a type, expected 1 to " +
                 std::to_string(elements - n));
      in_.require(size, 1, 4, "tags");
      in_.require(follow, 1, 4 * (1 + size + type.nodes), "elements");
      for (std::uint64_t k = 0; k < follow; ++k) {
        in_.integer("an element's number");
        const auto [physical, entity] = tags2(size);
        add_element(type, physical, entity);
      }
      n += follow;
    }
  }

  void read_elements4() {
    const std::uint64_t blocks = in_.count("the number of blocks");
    const std::uint64_t elements = in_.count("the number of elements");
    in_.count("the least number");
    in_.count("the largest number");
    in_.require(blocks, 4, 20, "blocks of elements");
    in_.require(elements, 2, 16, "elements");
    std::uint64_t seen = 0;
    for (std::uint64_t b = 0; b < blocks; ++b) {
      const std::int64_t dimension = in_.integer("a dimension");
      const std::int64_t entity = in_.integer("an entity's number");
      const Type& type = type_of(in_.integer("a type"));
      const std::uint64_t size = in_.count("the number of elements");
      in_.require(size, 1 + type.nodes, 8 * (1 + type.nodes), "elements");
      if (type.tetrahedron && dimension != 3)
        in_.fail("tetrahedra of dimension " + std::to_string(dimension) + ", expected 3");
      std::int64_t physical = 0;
      if (const auto at = physical_of_.find(entity); type.tetrahedron && at != physical_of_.end())
        physical = at->second;
      for (std::uint64_t n = 0; n < size; ++n) {
        in_.count("an element's number");
        add_element(type, physical, entity);
      }
      seen += size;
    }
    if (seen != elements)
      in_.fail(std::to_string(seen) + " elements in blocks, expected " + std::to_string(elements));
  }

  /// Version 4: the first physical group of each volume.
  void read_entities() {
    std::array<std::uint64_t, 4> sizes{};
    for (std::uint64_t& size : sizes) {
      size = in_.count("a number of entities");
      in_.require(size, 5, 28, "entities");
    }
    for (std::size_t dimension = 0; dimension < 4; ++dimension)
      for (std::uint64_t n = 0; n < sizes[dimension]; ++n) {
        const std::int64_t entity = in_.integer("an entity's number");
        for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k)
          entity_bound();
        const std::uint64_t groups = in_.count("the number of physical groups");
        in_.require(groups, 1, 4, "physical groups");
        for (std::uint64_t k = 0; k < groups; ++k) {
          const std::int64_t group = in_.integer("a physical group");
          if (dimension == 3 && k == 0)
            physical_of_[entity] = group;
        }
        if (dimension == 0)
          continue;
        const std::uint64_t sides = in_.count("the number of bounding entities");
        in_.require(sides, 1, 4, "bounding entities");
        for (std::uint64_t k = 0; k < sides; ++k)
          in_.integer("a bounding entity");
      }
  }

  /// Boxes are of no use to us, and infinite for some.
  void entity_bound() {
    if (in_.binary())
      in_.raw<double>();
    else if (in_.words().word().empty())
      in_.words().fail("the file ends here, expected an entity's box");
  }

  /// Physical groups are the material; where there are none, entities, if there are several.
  tetrahedra::TetMesh finish() {
    bool groups = false, several = false;
    for (std::size_t t = 0; t < entity_.size(); ++t) {
      groups = groups || physical_[t] != 0;
      several = several || entity_[t] != entity_[0];
    }
    if (!groups && !several)
      result_.mesh.material = {};
    for (std::size_t t = 0; t < result_.mesh.material.size(); ++t) {
      std::int64_t number = groups ? physical_[t] : entity_[t];
      if (groups && number == group_of_0_)
        number = 0;
      if (groups && number < 0) // a group that holds the entity turned over
        number = -number;
      if (number < 0 || number > INT32_MAX)
        throw Error(in_.name(), "tetrahedron " + std::to_string(t) + " of entity " +
                                    std::to_string(number) + ", expected 0 to " +
                                    std::to_string(INT32_MAX));
      result_.mesh.material[t] = static_cast<std::int32_t>(number);
    }
    return std::move(result_.mesh);
  }

  MshNumbers in_;
  TetReadStats& stats_;
  Tetrahedra result_;
  NodeTags tags_;
  std::vector<std::int64_t> physical_, entity_; // of each tetrahedron
  std::map<std::int64_t, std::int64_t> physical_of_;
  std::optional<std::int64_t> group_of_0_;
  bool has_format_ = false, has_nodes_ = false, has_elements_ = false;
  bool version1_ = false;
};

} // namespace

tetrahedra::TetMesh read_msh(std::string_view bytes, const std::string& name, TetReadStats& stats) {
  return MshReader(bytes, name, stats).read();
}

} // namespace gewebe::formats::tet
