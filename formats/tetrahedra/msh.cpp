#include "formats/tetrahedra/tet_file_internal.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <set>
// Based on: Geuzaine, Remacle, Gmsh reference manual 4.11, MSH file format, version 4.1, and
// legacy version 2.2.

namespace gewebe::tet {
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

/// How the physical group of material 0 is called: none may have the number 0.
constexpr std::string_view name_of_0 = "material 0";

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
      : words_(bytes, name, '\0'), name_(name), stats_(stats) {}

  TetMesh read() {
    for (std::string_view section = words_.word(); !section.empty(); section = words_.word())
      read_section(section);
    if (!has_format_)
      words_.fail("no Gmsh mesh, expected $MeshFormat");
    if (!has_nodes_ || !has_elements_)
      words_.fail(std::string("the file ends without ") + (has_nodes_ ? "$Elements" : "$Nodes") +
                  ", expected them");
    return finish();
  }

private:
  void read_section(std::string_view section) {
    if (section[0] != '$' || section.size() < 2)
      words_.fail(quoted(section) + ", expected a section, such as $Nodes");
    const std::string end = "$End" + std::string(section.substr(1));
    if (section == "$Comments") {
      skip_to(end);
    } else if (section == "$MeshFormat") {
      read_format();
    } else if (!has_format_) {
      words_.fail(std::string(section) + " before $MeshFormat, expected that first");
    } else if (section == "$Nodes") {
      if (has_nodes_)
        words_.fail("a second $Nodes, expected one");
      has_nodes_ = true;
      end_of_line();
      if (version_ == 2)
        read_nodes2();
      else
        read_nodes4();
      if (const auto twice = tags_.sort())
        words_.fail("two nodes of number " + std::to_string(*twice) + ", expected one");
    } else if (section == "$Elements") {
      if (!has_nodes_)
        words_.fail("$Elements before $Nodes, expected $Nodes first");
      has_elements_ = true;
      end_of_line();
      if (version_ == 2)
        read_elements2();
      else
        read_elements4();
    } else if (section == "$Entities" && version_ == 4) {
      end_of_line();
      read_entities();
    } else if (section == "$PhysicalNames") {
      read_names();
    } else if (section == "$PartitionedEntities") {
      words_.fail("a mesh in partitions, expected it in one");
    } else {
      skip_to(end);
      return;
    }
    if (section != "$Comments" && words_.word() != end)
      words_.fail("expected " + end);
  }

  void read_format() {
    const std::string_view version = words_.word();
    if (version == "2" || version == "2.0" || version == "2.1" || version == "2.2")
      version_ = 2;
    else if (version == "4.1")
      version_ = 4;
    else
      words_.fail("version " + quoted(version) + ", expected 2.2 or 4.1");
    const std::uint64_t type = words_.count("0 for text or 1 for binary");
    if (type > 1)
      words_.fail(std::to_string(type) + ", expected 0 for text or 1 for binary");
    if (words_.count("the size of numbers") != 8)
      words_.fail("numbers of another size, expected 8 bytes");
    binary_ = type == 1;
    has_format_ = true;
    if (!binary_)
      return;
    end_of_line();
    const std::int32_t one = raw<std::int32_t>();
    swap_ = one == 0x01000000;
    if (!swap_ && one != 1)
      fail("the order of bytes is not told, expected the integer 1");
  }

  // ---- Numbers, in text or binary

  [[noreturn]] void fail(const std::string& what) const {
    if (binary_)
      throw Error(name_, "byte " + std::to_string(words_.at()) + ": " + what);
    words_.fail(what);
  }

  /// Behind the name of a section whose bytes follow.
  void end_of_line() {
    if (binary_ && !words_.line().empty())
      words_.fail("words behind a section's name, expected the end of the line");
  }

  template <class T>
  T raw() {
    if (words_.left() < sizeof(T))
      fail("the file ends here, expected " + std::to_string(sizeof(T)) + " bytes");
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), words_.bytes().data() + words_.at(), sizeof(T));
    if (swap_)
      std::reverse(bytes.begin(), bytes.end());
    words_.move_to(words_.at() + sizeof(T));
    return std::bit_cast<T>(bytes);
  }

  double real(const char* what) {
    if (!binary_)
      return words_.real(what);
    const double number = raw<double>();
    if (!std::isfinite(number))
      fail(std::string(what) + " is not finite, expected a finite number");
    return number;
  }
  std::int64_t integer(const char* what) {
    return binary_ ? raw<std::int32_t>() : words_.integer(what);
  }
  /// Of 32 bits in binary files of version 2, 64 in those of 4.
  std::uint64_t count(const char* what) {
    if (!binary_)
      return words_.count(what);
    if (version_ == 4)
      return raw<std::uint64_t>();
    const std::int32_t number = raw<std::int32_t>();
    if (number < 0)
      fail(std::string(what) + " is " + std::to_string(number) + ", expected an integer from 0");
    return static_cast<std::uint64_t>(number);
  }
  /// Refuses counts that the file can't hold: each takes `words` words, or `bytes` bytes.
  void require(std::uint64_t count, std::size_t words, std::size_t bytes, const char* what) const {
    if (!binary_)
      words_.require(count, words, what);
    else if (count > words_.left() / bytes || count >= UINT32_MAX)
      fail(std::to_string(count) + " " + what + " in " + std::to_string(words_.left()) +
           " bytes, expected a count that fits");
  }

  void skip_to(const std::string& end) {
    const std::size_t at = words_.bytes().find(end, words_.at());
    if (at == std::string_view::npos)
      words_.fail("the file ends here, expected " + end);
    words_.move_to(at + end.size());
  }

  /// In text always. Of the names one tells us something.
  void read_names() {
    const std::uint64_t names = words_.count("the number of names");
    words_.require(names, 3, "names");
    for (std::uint64_t n = 0; n < names; ++n) {
      const std::int64_t dimension = words_.integer("a dimension"),
                         group = words_.integer("a physical group");
      const std::string_view name = words_.line();
      const std::size_t at = name.find('"');
      if (at == std::string_view::npos)
        words_.fail("expected a name in quotes");
      if (dimension == 3 && name.substr(at + 1).starts_with(name_of_0) &&
          name.substr(at + 1 + name_of_0.size()).starts_with('"'))
        group_of_0_ = group;
    }
  }

  // ---- Nodes

  void add_node(std::uint64_t tag) {
    const double x = real("x"), y = real("y"), z = real("z");
    tags_.add(tag);
    result_.mesh.points.push_back({x, y, z});
  }

  void read_nodes2() {
    const std::uint64_t nodes = words_.count("the number of nodes");
    end_of_line();
    require(nodes, 4, 28, "nodes");
    tags_.reserve(nodes);
    result_.mesh.points.reserve(nodes);
    for (std::uint64_t n = 0; n < nodes; ++n)
      add_node(count("a node's number"));
  }

  void read_nodes4() {
    const std::uint64_t blocks = count("the number of blocks");
    count("the number of nodes"); // Gmsh counts those that entities share several times
    count("the least number");
    count("the largest number");
    require(blocks, 4, 20, "blocks of nodes");
    std::vector<std::uint64_t> tags;
    for (std::uint64_t b = 0; b < blocks; ++b) {
      const std::int64_t dimension = integer("a dimension");
      integer("an entity's number");
      const std::int64_t parametric = integer("0 or 1");
      if (dimension < 0 || dimension > 3 || parametric < 0 || parametric > 1)
        fail("a block of nodes of dimension " + std::to_string(dimension) +
             ", expected 0 to 3, then 0 or 1");
      const std::uint64_t size = count("the number of nodes");
      require(size, 4, 32, "nodes");
      tags.clear();
      for (std::uint64_t n = 0; n < size; ++n)
        tags.push_back(count("a node's number"));
      for (const std::uint64_t tag : tags) {
        add_node(tag);
        for (std::int64_t u = 0; u < dimension * parametric; ++u)
          real("a parameter");
      }
    }
  }

  // ---- Elements

  const Type& type_of(std::int64_t number) const {
    for (const Type& type : known)
      if (type.number == number)
        return type;
    fail(refused_name(number) + ", expected tetrahedra of 4 or 10 nodes");
  }

  /// Reads the nodes of an element and keeps it if it is a tetrahedron.
  void add_element(const Type& type, std::int64_t physical, std::int64_t entity) {
    if (!type.tetrahedron) {
      for (std::size_t k = 0; k < type.nodes; ++k)
        count("a node");
      ++stats_.skipped_elements;
      return;
    }
    std::array<std::uint32_t, 10> nodes{};
    for (std::size_t k = 0; k < type.nodes; ++k) {
      const std::uint64_t tag = count("a node");
      const auto index = tags_.find(tag);
      if (!index)
        fail("an element with node " + std::to_string(tag) + ", which is not there");
      nodes[k] = *index;
    }
    std::swap(nodes[8], nodes[9]); // Gmsh's edge 23 comes before 13
    result_.add(std::span(nodes).first(type.nodes), 0,
                [&](const std::string& what) { fail(what); });
    physical_.push_back(physical);
    entity_.push_back(entity);
  }

  /// Reads the tags of an element of version 2, and what they are.
  std::pair<std::int64_t, std::int64_t> tags2(std::uint64_t size) {
    std::pair<std::int64_t, std::int64_t> tags{0, 0};
    for (std::uint64_t k = 0; k < size; ++k) {
      const std::int64_t tag = integer("a tag");
      if (k < 2)
        (k == 0 ? tags.first : tags.second) = tag;
    }
    return tags;
  }

  void read_elements2() {
    const std::uint64_t elements = words_.count("the number of elements");
    end_of_line();
    require(elements, 4, 8, "elements");
    for (std::uint64_t n = 0; n < elements;) {
      if (!binary_) {
        words_.count("an element's number");
        const Type& type = type_of(words_.integer("a type"));
        const std::uint64_t size = words_.count("the number of tags");
        words_.require(size, 1, "tags");
        const auto [physical, entity] = tags2(size);
        add_element(type, physical, entity);
        ++n;
        continue;
      }
      const Type& type = type_of(integer("a type"));
      const std::uint64_t follow = count("the number of elements"),
                          size = count("a number of tags");
      if (follow == 0 || follow > elements - n)
        fail(std::to_string(follow) + " elements of a type, expected 1 to " +
             std::to_string(elements - n));
      require(size, 1, 4, "tags");
      require(follow, 1, 4 * (1 + size + type.nodes), "elements");
      for (std::uint64_t k = 0; k < follow; ++k) {
        integer("an element's number");
        const auto [physical, entity] = tags2(size);
        add_element(type, physical, entity);
      }
      n += follow;
    }
  }

  void read_elements4() {
    const std::uint64_t blocks = count("the number of blocks");
    const std::uint64_t elements = count("the number of elements");
    count("the least number");
    count("the largest number");
    require(blocks, 4, 20, "blocks of elements");
    require(elements, 2, 16, "elements");
    std::uint64_t seen = 0;
    for (std::uint64_t b = 0; b < blocks; ++b) {
      const std::int64_t dimension = integer("a dimension");
      const std::int64_t entity = integer("an entity's number");
      const Type& type = type_of(integer("a type"));
      const std::uint64_t size = count("the number of elements");
      require(size, 1 + type.nodes, 8 * (1 + type.nodes), "elements");
      if (type.tetrahedron && dimension != 3)
        fail("tetrahedra of dimension " + std::to_string(dimension) + ", expected 3");
      std::int64_t physical = 0;
      if (const auto at = physical_of_.find(entity); type.tetrahedron && at != physical_of_.end())
        physical = at->second;
      for (std::uint64_t n = 0; n < size; ++n) {
        count("an element's number");
        add_element(type, physical, entity);
      }
      seen += size;
    }
    if (seen != elements)
      fail(std::to_string(seen) + " elements in blocks, expected " + std::to_string(elements));
  }

  /// Version 4: the first physical group of each volume.
  void read_entities() {
    std::array<std::uint64_t, 4> sizes{};
    for (std::uint64_t& size : sizes) {
      size = count("a number of entities");
      require(size, 5, 28, "entities");
    }
    for (std::size_t dimension = 0; dimension < 4; ++dimension)
      for (std::uint64_t n = 0; n < sizes[dimension]; ++n) {
        const std::int64_t entity = integer("an entity's number");
        for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k)
          entity_bound();
        const std::uint64_t groups = count("the number of physical groups");
        require(groups, 1, 4, "physical groups");
        for (std::uint64_t k = 0; k < groups; ++k) {
          const std::int64_t group = integer("a physical group");
          if (dimension == 3 && k == 0)
            physical_of_[entity] = group;
        }
        if (dimension == 0)
          continue;
        const std::uint64_t sides = count("the number of bounding entities");
        require(sides, 1, 4, "bounding entities");
        for (std::uint64_t k = 0; k < sides; ++k)
          integer("a bounding entity");
      }
  }

  /// Boxes are of no use to us, and infinite for some.
  void entity_bound() {
    if (binary_)
      raw<double>();
    else if (words_.word().empty())
      words_.fail("the file ends here, expected an entity's box");
  }

  /// Physical groups are the material; where there are none, entities, if there are several.
  TetMesh finish() {
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
        throw Error(name_, "tetrahedron " + std::to_string(t) + " of entity " +
                               std::to_string(number) + ", expected 0 to " +
                               std::to_string(INT32_MAX));
      result_.mesh.material[t] = static_cast<std::int32_t>(number);
    }
    return std::move(result_.mesh);
  }

  Words words_;
  const std::string& name_;
  TetReadStats& stats_;
  Tetrahedra result_;
  NodeTags tags_;
  std::vector<std::int64_t> physical_, entity_; // of each tetrahedron
  std::map<std::int64_t, std::int64_t> physical_of_;
  std::optional<std::int64_t> group_of_0_;
  int version_ = 0;
  bool binary_ = false, swap_ = false;
  bool has_format_ = false, has_nodes_ = false, has_elements_ = false;
};

/// Corners and middles of one in Gmsh's order.
std::array<std::uint32_t, 10> gmsh_nodes(const TetNodes& nodes) {
  std::array<std::uint32_t, 10> order{};
  for (std::size_t k = 0; k < nodes.size(); ++k)
    order[k] = nodes[k];
  std::swap(order[8], order[9]);
  return order;
}

int type_of(const TetMesh& mesh) {
  return mesh.middles.empty() ? 4 : 11;
}

/// The numbers of entities and of their physical groups: those of the materials, ascending, and the
/// smallest free one for material 0. Of a mesh without materials one, 1, and no groups.
struct Groups {
  explicit Groups(const TetMesh& mesh) : any(!mesh.material.empty()) {
    for (const std::int32_t m : mesh.material)
      if (materials.empty() || m != *materials.rbegin())
        materials.insert(m);
    if (materials.empty())
      materials.insert(0);
    while (materials.contains(of_0))
      ++of_0;
  }
  std::int32_t of(std::int32_t material) const { return material == 0 ? of_0 : material; }
  std::int32_t of(const TetMesh& mesh, std::size_t t) const {
    return of(mesh.material.empty() ? 0 : mesh.material[t]);
  }
  void write_name(Pieces& out) const {
    if (any && materials.contains(0))
      out << "$PhysicalNames\n1\n3 " << of_0 << " \"" << name_of_0 << "\"\n$EndPhysicalNames\n";
  }

  bool any;
  std::set<std::int32_t> materials;
  std::int32_t of_0 = 1;
};

} // namespace

TetMesh read_msh(std::string_view bytes, const std::string& name, TetReadStats& stats) {
  return MshReader(bytes, name, stats).read();
}

void write_msh2(const TetMesh& mesh, const Sink& sink) {
  Pieces out(sink);
  const Groups groups(mesh);
  out << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
  groups.write_name(out);
  out << "$Nodes\n" << mesh.points.size() << "\n";
  for (std::size_t p = 0; p < mesh.points.size(); ++p) {
    const Vec3& point = mesh.points[p];
    out << p + 1 << " " << point.x << " " << point.y << " " << point.z << "\n";
  }
  out << "$EndNodes\n$Elements\n" << mesh.tetrahedra.size() << "\n";
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const std::int32_t group = groups.of(mesh, t);
    out << t + 1 << " " << type_of(mesh) << " 2 " << (groups.any ? group : 0) << " " << group;
    const TetNodes nodes(mesh, t);
    const auto order = gmsh_nodes(nodes);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      out << " " << std::uint64_t{order[k]} + 1;
    out << "\n";
  }
  out << "$EndElements\n";
  out.flush();
}

void write_msh4(const TetMesh& mesh, const Sink& sink) {
  const auto size = [](std::size_t n) { return std::uint64_t{n}; };
  const Groups groups(mesh);
  Pieces out(sink);
  out << "$MeshFormat\n4.1 1 8\n";
  out.put(std::int32_t{1});
  out << "\n$EndMeshFormat\n";
  groups.write_name(out);
  out << "$Entities\n";
  for (int dimension = 0; dimension < 3; ++dimension)
    out.put(size(0));
  out.put(size(groups.materials.size()));
  const Box3 box = mesh.points.empty() ? Box3{{}, {}} : bounding_box(mesh);
  for (const std::int32_t material : groups.materials) {
    out.put(groups.of(material));
    out.put(box.min);
    out.put(box.max);
    out.put(size(groups.any ? 1 : 0));
    if (groups.any)
      out.put(groups.of(material));
    out.put(size(0));
  }
  out << "\n$EndEntities\n$Nodes\n";
  const std::size_t points = mesh.points.size();
  out.put(size(points == 0 ? 0 : 1));
  out.put(size(points));
  out.put(size(points == 0 ? 0 : 1));
  out.put(size(points));
  if (points > 0) {
    out.put(std::int32_t{3});
    out.put(groups.of(*groups.materials.begin()));
    out.put(std::int32_t{0});
    out.put(size(points));
    for (std::size_t p = 0; p < points; ++p)
      out.put(size(p + 1));
    for (const Vec3& p : mesh.points)
      out.put(p);
  }
  out << "\n$EndNodes\n$Elements\n";
  // Tetrahedra keep their order: a block for each run of one material.
  std::vector<std::size_t> runs;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    if (t == 0 || (!mesh.material.empty() && mesh.material[t] != mesh.material[t - 1]))
      runs.push_back(t);
  out.put(size(runs.size()));
  out.put(size(mesh.tetrahedra.size()));
  out.put(size(mesh.tetrahedra.empty() ? 0 : 1));
  out.put(size(mesh.tetrahedra.size()));
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::size_t end = r + 1 < runs.size() ? runs[r + 1] : mesh.tetrahedra.size();
    out.put(std::int32_t{3});
    out.put(groups.of(mesh, runs[r]));
    out.put(std::int32_t{type_of(mesh)});
    out.put(size(end - runs[r]));
    for (std::size_t t = runs[r]; t < end; ++t) {
      out.put(size(t + 1));
      const TetNodes nodes(mesh, t);
      const auto order = gmsh_nodes(nodes);
      for (std::size_t k = 0; k < nodes.size(); ++k)
        out.put(size(order[k]) + 1);
    }
  }
  out << "\n$EndElements\n";
  out.flush();
}

} // namespace gewebe::tet
