#include "formats/mesh/assimp_child.h"

#include "base/error.h"
#include "formats/stream/child.h"
#include "formats/stream/file_names.h"
#include "mesh/triangulate.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include <assimp/DefaultLogger.hpp>
#include <assimp/Exporter.hpp>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/LogStream.hpp>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/importerdesc.h>
#include <assimp/scene.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace gewebe::formats {
namespace {

// ---- formats

struct Format {
  Kind kind;
  const char* importer; // assimp's name of it
  const char* suffix;   // by which assimp finds the importer
  const char* shown;    // in messages
};

constexpr std::array<Format, 8> formats{{
    {Kind::obj, "Wavefront Object Importer", "obj", "OBJ"},
    {Kind::stl, "Stereolithography (STL) Importer", "stl", "STL"},
    {Kind::off, "OFF Importer", "off", "OFF"},
    {Kind::dxf, "Drawing Interchange Format (DXF) Importer", "dxf", "DXF"},
    {Kind::gltf, "glTF2 Importer", "gltf", "glTF 2"},
    {Kind::glb, "glTF2 Importer", "glb", "GLB"},
    {Kind::three_ds, "Discreet 3DS Importer", "3ds", "3DS"},
    {Kind::dae, "Collada Importer", "dae", "Collada"},
}};

const Format& format_of(Kind kind) {
  for (const Format& format : formats)
    if (format.kind == kind)
      return format;
  throw Error("no mesh format of assimp: " + std::string(kind_name(kind)));
}

// The name under which assimp knows the input.
constexpr std::string_view input_stem = "gewebe-input.";

constexpr const char* out_of_memory = "out of memory";

std::string one_line(std::string text) {
  // Of exceptions that assimp turns into texts.
  for (const char* const words : {"std::bad_alloc", "max_size()", "vector::", "basic_string::"})
    if (text.find(words) != std::string::npos)
      text = out_of_memory;
  for (char& c : text)
    if (std::iscntrl(static_cast<unsigned char>(c)) || static_cast<unsigned char>(c) > 126)
      c = ' ';
  while (!text.empty() && (text.back() == ' ' || text.back() == '.'))
    text.pop_back();
  if (text.size() > 160)
    text = text.substr(0, 157) + "...";
  return text.empty() ? "no reason given" : text;
}

// ---- side files

constexpr std::size_t max_side_file = std::size_t{1} << 30;

// The input in memory under a name of its own; beside it whatever regular files lie in its folder
// and below. `refused` is the first name that leads elsewhere.
class InputFiles : public Assimp::IOSystem {
public:
  InputFiles(std::string_view bytes, std::string name, std::string folder, std::string& refused)
      : bytes_(bytes), name_(std::move(name)), folder_(std::move(folder)), refused_(refused) {}

  bool Exists(const char* path) const override {
    if (name_ == path)
      return true;
    struct stat status {};
    return may_read(path) && ::stat(path, &status) == 0 && S_ISREG(status.st_mode);
  }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* path, const char* mode) override {
    if (mode != nullptr && mode[0] != 'r')
      return nullptr;
    if (name_ == path)
      return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(bytes_.data()),
                                        bytes_.size());
    if (may_read(path))
      return open_side_file(path);
    if (!folder_.empty() && refused_.empty())
      refused_ = std::string_view(path).starts_with(folder_) ? path + folder_.size() : path;
    return nullptr;
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

private:
  bool may_read(std::string_view path) const {
    return !folder_.empty() && path.starts_with(folder_) &&
           !leaves_folder(path.substr(folder_.size()));
  }
  static Assimp::IOStream* open_side_file(const char* path) {
    const int fd = ::open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC); // a FIFO must not hold us
    if (fd < 0)
      return nullptr;
    struct stat status {};
    std::unique_ptr<std::uint8_t[]> data;
    std::size_t size = 0;
    if (::fstat(fd, &status) == 0 && S_ISREG(status.st_mode) &&
        static_cast<std::size_t>(status.st_size) <= max_side_file) {
      const std::size_t expected = static_cast<std::size_t>(status.st_size);
      data = std::make_unique<std::uint8_t[]>(expected + 1);
      while (size < expected) {
        const ssize_t got = ::read(fd, data.get() + size, expected - size);
        if (got <= 0)
          break;
        size += static_cast<std::size_t>(got);
      }
    }
    ::close(fd);
    return data ? new Assimp::MemoryIOStream(data.release(), size, true) : nullptr;
  }

  std::string_view bytes_;
  std::string name_, folder_; // which ends in /, or nothing is read
  std::string& refused_;
};

// ---- scene to mesh

// Rows of an affine transform.
struct Affine {
  std::array<std::array<double, 4>, 3> row{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

  Vec3 operator()(const aiVector3D& p) const {
    const auto of = [&](const std::array<double, 4>& r) {
      return r[0] * static_cast<double>(p.x) + r[1] * static_cast<double>(p.y) +
             r[2] * static_cast<double>(p.z) + r[3];
    };
    return {of(row[0]), of(row[1]), of(row[2])};
  }
  bool mirrors() const {
    const Vec3 x{row[0][0], row[0][1], row[0][2]}, y{row[1][0], row[1][1], row[1][2]},
        z{row[2][0], row[2][1], row[2][2]};
    return dot(x, cross(y, z)) < 0;
  }
};

// The double that the float's shortest decimal form stands for: a unit of 0.001 in a text file is
// meant so, not as 0.001000000047.
double decimal(float value) {
  std::array<char, 32> text;
  const char* end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double result = 0;
  std::from_chars(text.data(), end, result);
  return result;
}

Affine operator*(const Affine& a, const aiMatrix4x4& b) {
  Affine product;
  for (std::size_t i = 0; i < 3; ++i)
    for (unsigned j = 0; j < 4; ++j) {
      double sum = j == 3 ? a.row[i][3] : 0;
      for (unsigned k = 0; k < 3; ++k)
        sum += a.row[i][k] * decimal(b[k][j]);
      product.row[i][j] = sum;
    }
  return product;
}

class SceneReader {
public:
  SceneReader(const aiScene& scene, Kind kind) : scene_(scene), kind_(kind) {}

  TriangleMesh read(AssimpStats& stats) {
    Affine root;
    if (kind_ == Kind::gltf || kind_ == Kind::glb || kind_ == Kind::dae)
      root.row = {{{1000, 0, 0, 0}, {0, 1000, 0, 0}, {0, 0, 1000, 0}}}; // metres
    // For these two assimp turns the scene about x to make its y point up: turned back here.
    if (kind_ == Kind::dxf || kind_ == Kind::three_ds)
      root.row = {{{1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}}};
    for (unsigned m = 0; m < scene_.mNumMeshes; ++m)
      textured_ = textured_ || scene_.mMeshes[m]->HasTextureCoords(0);
    if (scene_.mRootNode != nullptr)
      visit(*scene_.mRootNode, root);
    if (parts_ < 2) {
      mesh_.part.clear();
      stats_.part_names.clear();
    }
    if (materials_.size() < 2)
      mesh_.material.clear();
    stats = stats_;
    return std::move(mesh_);
  }

private:
  void visit(const aiNode& node, const Affine& parent) {
    const Affine transform = parent * node.mTransformation;
    std::optional<std::int32_t> part;
    for (unsigned m = 0; m < node.mNumMeshes; ++m) {
      if (node.mMeshes[m] >= scene_.mNumMeshes)
        throw Error("a node of a mesh that isn't there");
      add(*scene_.mMeshes[node.mMeshes[m]], node, transform, part);
    }
    for (unsigned c = 0; c < node.mNumChildren; ++c)
      visit(*node.mChildren[c], transform);
  }

  std::int32_t part_of(const aiNode& node) {
    const std::string name(node.mName.C_Str());
    if (kind_ == Kind::obj && !name.empty()) {
      const auto [entry, fresh] = named_.try_emplace(name, parts_);
      if (!fresh)
        return entry->second;
    }
    stats_.part_names.push_back(name);
    return parts_++;
  }

  void add(const aiMesh& from, const aiNode& node, const Affine& transform,
           std::optional<std::int32_t>& part) {
    const bool mirrored = transform.mirrors();
    std::vector<Vec3> points(from.mVertices == nullptr ? 0 : from.mNumVertices);
    for (unsigned v = 0; v < points.size(); ++v)
      points[v] = transform(from.mVertices[v]);

    numbers_.assign(points.size(), UINT32_MAX);
    std::int32_t material = -1;
    std::vector<std::uint32_t> corners;
    std::vector<Vec3> polygon;
    std::vector<Triangle> cut;
    for (unsigned f = 0; f < from.mNumFaces; ++f) {
      const aiFace& face = from.mFaces[f];
      corners.assign(face.mIndices, face.mIndices + face.mNumIndices);
      for (const std::uint32_t corner : corners)
        if (corner >= points.size())
          throw Error("a corner index beyond the points");
      if (corners.size() > 3)
        drop_repeated(corners, points);
      if (corners.size() < 3) {
        ++stats_.skipped_primitives;
        continue;
      }
      if (mirrored)
        std::reverse(corners.begin(), corners.end());
      polygon.clear();
      for (const std::uint32_t corner : corners)
        polygon.push_back(points[corner]);
      cut.clear();
      mesh::triangulate_polygon(polygon, cut);
      stats_.polygons += corners.size() > 3;
      if (!part)
        part = part_of(node);
      if (material < 0)
        material =
            materials_
                .try_emplace(from.mMaterialIndex, static_cast<std::int32_t>(materials_.size()))
                .first->second;
      for (const Triangle& t : cut) {
        add_triangle({corners[t[0]], corners[t[1]], corners[t[2]]}, points, from);
        mesh_.part.push_back(*part);
        mesh_.material.push_back(material);
      }
    }
  }

  // DXF writes a triangle as a quad whose last corners are equal.
  static void drop_repeated(std::vector<std::uint32_t>& corners, const std::vector<Vec3>& points) {
    const auto same = [&](std::uint32_t a, std::uint32_t b) { return points[a] == points[b]; };
    corners.erase(std::unique(corners.begin(), corners.end(), same), corners.end());
    while (corners.size() > 1 && same(corners.front(), corners.back()))
      corners.pop_back();
  }

  // The number in our mesh of a point of the assimp mesh at hand, entered at its first use.
  std::uint32_t point(std::uint32_t corner, const std::vector<Vec3>& points) {
    if (numbers_[corner] == UINT32_MAX) {
      if (mesh_.points.size() >= UINT32_MAX)
        throw Error("over 4294967294 points");
      numbers_[corner] = static_cast<std::uint32_t>(mesh_.points.size());
      mesh_.points.push_back(points[corner]);
    }
    return numbers_[corner];
  }

  void add_triangle(const Triangle& t, const std::vector<Vec3>& points, const aiMesh& from) {
    mesh_.triangles.push_back({point(t[0], points), point(t[1], points), point(t[2], points)});
    if (!textured_)
      return;
    std::array<float, 6> st{};
    if (from.HasTextureCoords(0))
      for (std::size_t k = 0; k < 3; ++k) {
        st[2 * k] = from.mTextureCoords[0][t[k]].x;
        st[2 * k + 1] = from.mTextureCoords[0][t[k]].y;
      }
    mesh_.texcoords.push_back(st);
  }

  const aiScene& scene_;
  Kind kind_;
  TriangleMesh mesh_;
  AssimpStats stats_;
  bool textured_ = false;
  std::int32_t parts_ = 0;
  std::map<std::string, std::int32_t> named_;
  std::vector<std::uint32_t> numbers_;
  std::map<unsigned, std::int32_t> materials_; // assimp's number to ours
};

// Some importers put right what is broken, or leave out what they don't support, and only log it:
// an index out of range becomes the last one, a truncated file a shorter one. These words in the
// log are errors.
constexpr std::array<std::string_view, 17> broken{
    "OFF: Vertex index is out of range",
    "OFF: Number of vertex coordinates higher than 3",
    "OFF: Faces with zero indices",
    "3DS: Vertex index overflow",
    "3DS: Chunk overflow",
    "OBJ: vertex index out of range",
    "STL: unexpected EOF while parsing facet",
    "STL: A new facet begins but the old is not yet complete",
    "STL: a facet with more than 3 vertices",
    "DXF: EOF reached, but did not encounter DXF EOF marker",
    "DXF: BLOCK rotation not currently implemented",
    "DXF: INSERT within a BLOCK not currently supported",
    "DXF: Failed to resolve block reference",
    "DXF: not enough vertices for polymesh",
    "DXF: more than 4 indices per face",
    "Collada: Unable to find geometry",
    "Collada: Unable to resolve reference to instanced node",
};

class LogReader : public Assimp::LogStream {
public:
  explicit LogReader(std::string& first) : first_(first) {}
  void write(const char* message) override {
    if (!first_.empty())
      return;
    const std::string_view text = message;
    for (const std::string_view words : broken)
      if (const std::size_t at = text.find(words); at != std::string_view::npos)
        first_ = text.substr(at);
  }

private:
  std::string& first_;
};

// assimp knows a DXF file by a word in its first bytes; comments (group 999) before it hide that.
std::string_view without_dxf_comments(std::string_view bytes) {
  std::string_view rest = bytes;
  for (;;) {
    const std::size_t code_end = rest.find('\n');
    if (code_end == std::string_view::npos)
      return bytes;
    std::string_view code = rest.substr(0, code_end);
    while (!code.empty() && std::isspace(static_cast<unsigned char>(code.front())))
      code.remove_prefix(1);
    while (!code.empty() && std::isspace(static_cast<unsigned char>(code.back())))
      code.remove_suffix(1);
    if (code != "999")
      return rest;
    const std::size_t text_end = rest.find('\n', code_end + 1);
    if (text_end == std::string_view::npos)
      return bytes;
    rest.remove_prefix(text_end + 1);
  }
}

// assimp's complaints about `name`, which only we know.
std::string without(std::string text, const std::string& name) {
  for (std::size_t at = 0; (at = text.find(name, at)) != std::string::npos;)
    text.replace(at, name.size(), "it");
  return text;
}

TriangleMesh import(const AssimpSource& source, AssimpStats& stats) {
  const Format& format = format_of(source.kind);
  std::string logged;
  Assimp::DefaultLogger::create("", Assimp::Logger::NORMAL, 0);
  Assimp::DefaultLogger::get()->attachStream(new LogReader(logged),
                                             Assimp::Logger::Warn | Assimp::Logger::Err);
  Assimp::Importer importer;
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;)
    if (std::strcmp(importer.GetImporterInfo(i)->mName, format.importer) != 0)
      importer.UnregisterLoader(importer.GetImporter(i));
  if (importer.GetImporterCount() != 1)
    throw Error("this assimp has no importer for it");
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);

  const std::string folder = source.folder.empty() ? "" : source.folder + "/";
  const std::string name = folder + std::string(input_stem) + format.suffix;
  const std::string_view bytes =
      source.kind == Kind::dxf ? without_dxf_comments(source.bytes) : source.bytes;
  std::string refused;
  importer.SetIOHandler(new InputFiles(bytes, name, folder, refused));
  const aiScene* scene = importer.ReadFile(name, 0);
  if (scene == nullptr && !refused.empty())
    throw Error("it names '" + refused + "', which is not in its own folder or below");
  if (scene == nullptr)
    throw Error(without(importer.GetErrorString(), name));
  if (!logged.empty())
    throw Error(logged);
  TriangleMesh mesh = SceneReader(*scene, source.kind).read(stats);
  if (mesh.triangles.empty())
    throw Error("no triangle in it");
  return mesh;
}

// ---- the pipe

struct WireHead {
  std::uint64_t points, triangles, texcoords, part, material, polygons, skipped, names;
};

template <class T>
void append(std::string& bytes, const std::vector<T>& values) {
  if (values.empty())
    return;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <class T>
void take(std::string_view& bytes, std::uint64_t count, std::vector<T>& values) {
  if (count > bytes.size() / sizeof(T))
    throw Error("the reader's answer is broken");
  if (count == 0)
    return;
  values.resize(static_cast<std::size_t>(count));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  bytes.remove_prefix(values.size() * sizeof(T));
}

std::string to_wire(const TriangleMesh& mesh, const AssimpStats& stats) {
  std::string names; // each with a 0 behind it, which none holds
  for (const std::string& name : stats.part_names)
    names.append(name.c_str(), name.size() + 1);
  const WireHead head{mesh.points.size(),       mesh.triangles.size(), mesh.texcoords.size(),
                      mesh.part.size(),         mesh.material.size(),  stats.polygons,
                      stats.skipped_primitives, names.size()};
  std::string bytes;
  bytes.reserve(sizeof head + mesh.points.size() * sizeof(Vec3) +
                mesh.triangles.size() * (sizeof(Triangle) + 8) +
                mesh.texcoords.size() * sizeof(mesh.texcoords[0]));
  bytes.append(reinterpret_cast<const char*>(&head), sizeof head);
  append(bytes, mesh.points);
  append(bytes, mesh.triangles);
  append(bytes, mesh.texcoords);
  append(bytes, mesh.part);
  append(bytes, mesh.material);
  return bytes + names;
}

// The child may have been corrupted by its input: nothing of it is believed unchecked.
TriangleMesh from_wire(std::string_view bytes, AssimpStats* stats) {
  WireHead head{};
  if (bytes.size() < sizeof head)
    throw Error("the reader's answer is broken");
  std::memcpy(&head, bytes.data(), sizeof head);
  bytes.remove_prefix(sizeof head);
  TriangleMesh mesh;
  take(bytes, head.points, mesh.points);
  take(bytes, head.triangles, mesh.triangles);
  take(bytes, head.texcoords, mesh.texcoords);
  take(bytes, head.part, mesh.part);
  take(bytes, head.material, mesh.material);
  if (bytes.size() != head.names || (!bytes.empty() && bytes.back() != '\0'))
    throw Error("the reader's answer is broken");
  check_mesh(mesh);
  if (stats != nullptr) {
    *stats = {head.polygons, head.skipped, {}};
    for (std::string_view name; !bytes.empty(); bytes.remove_prefix(name.size() + 1)) {
      name = bytes.substr(0, bytes.find('\0'));
      stats->part_names.emplace_back(name);
    }
  }
  return mesh;
}

// Room and time that a file of this size may take. Measured at a million triangles: the readers
// need up to 14 times the file's size and 1 s of processor time for 50 MB. A small file gets 256
// MiB and 1 s.
ChildLimits limits_for(std::uint64_t bytes) {
  ChildLimits limits;
  limits.memory = (std::uint64_t{256} << 20) + 100 * bytes;
  limits.cpu_seconds = 1 + static_cast<unsigned>(std::min<std::uint64_t>(bytes / 2'000'000, 3600));
  limits.seconds = 30.0 * limits.cpu_seconds;
  return limits;
}

// ---- what is wrong where assimp only runs out of memory

// The words of a text, with their lines.
class Words {
public:
  Words(std::string_view text, std::size_t line) : text_(text), line_(line) {}
  std::size_t line() const { return line_; }
  // Empty at the end.
  std::string_view next() {
    while (at_ < text_.size() && is_space(text_[at_]))
      line_ += text_[at_++] == '\n';
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_]))
      ++at_;
    return text_.substr(begin, at_ - begin);
  }

private:
  static bool is_space(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }
  std::string_view text_;
  std::size_t at_ = 0, line_;
};

std::string quoted(std::string_view word) {
  return "'" + std::string(word.substr(0, 40)) + (word.size() > 40 ? "...'" : "'");
}

bool is_number(std::string_view word) {
  if (word.starts_with('+'))
    word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return end == word.data() + word.size() && error != std::errc::invalid_argument;
}

// The first count of an OFF file that its bytes cannot hold.
std::string fault_of_off(std::string_view bytes) {
  Words words(bytes, 1);
  std::string_view word = words.next();
  if (!word.empty() && !is_number(word)) // OFF, COFF, STOFF, ...
    word = words.next();
  for (const char* const what : {"points", "faces"}) {
    double count = 0;
    (void)std::from_chars(word.data(), word.data() + word.size(), count);
    if (count > static_cast<double>(bytes.size()) / 2)
      return "line " + std::to_string(words.line()) + ": " + quoted(word) + " " + what +
             " in a file of " + std::to_string(bytes.size()) + " bytes";
    word = words.next();
  }
  return "";
}

// The first word in a Collada file's lists of numbers that is none.
std::string fault_of_collada(std::string_view bytes) {
  std::size_t line = 1, counted = 0;
  for (std::size_t at = 0; (at = bytes.find('<', at)) != std::string_view::npos;) {
    const std::size_t name_end = bytes.find_first_of(" \t\r\n>", ++at);
    const std::size_t open = bytes.find('>', at);
    if (open == std::string_view::npos)
      break;
    const std::string_view name = bytes.substr(at, name_end - at);
    if (name != "p" && name != "vcount" && name != "float_array")
      continue;
    line += static_cast<std::size_t>(
        std::count(bytes.begin() + static_cast<std::ptrdiff_t>(counted),
                   bytes.begin() + static_cast<std::ptrdiff_t>(open), '\n'));
    counted = open;
    Words words(bytes.substr(open + 1, bytes.find('<', open) - open - 1), line);
    for (std::string_view word = words.next(); !word.empty(); word = words.next())
      if (!is_number(word))
        return "line " + std::to_string(words.line()) + ": " + quoted(word) + " in <" +
               std::string(name) + ">, expected a number";
  }
  return "";
}

// What is wrong with an input that needs more memory than limits_for gives, which no valid file of
// its size does.
std::string fault_of_size(const AssimpSource& source) {
  std::string fault;
  if (source.kind == Kind::off)
    fault = fault_of_off(source.bytes);
  if (source.kind == Kind::dae)
    fault = fault_of_collada(source.bytes);
  return fault.empty() ? "a count or an index in it goes far beyond its " +
                             std::to_string(source.bytes.size()) + " bytes"
                       : fault;
}

// ---- mesh to scene

// The triangles of one part and material.
struct Group {
  std::int32_t part = 0, material = 0;
  std::vector<std::uint32_t> triangles;
};

std::vector<Group> groups_of(const TriangleMesh& mesh) {
  std::map<std::pair<std::int32_t, std::int32_t>, Group> groups;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::int32_t part = mesh.part.empty() ? 0 : mesh.part[t];
    const std::int32_t material = mesh.material.empty() ? 0 : mesh.material[t];
    Group& group = groups[{part, material}];
    group.part = part;
    group.material = material;
    group.triangles.push_back(t);
  }
  std::vector<Group> list;
  for (auto& entry : groups)
    list.push_back(std::move(entry.second));
  return list;
}

aiMesh* make_mesh(const TriangleMesh& mesh, const Group& group, double scale) {
  using Corner = std::array<std::uint32_t, 3>; // point and the bits of s and t
  std::map<Corner, std::uint32_t> numbers;
  std::vector<Corner> vertices;
  auto out = std::make_unique<aiMesh>();
  out->mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  out->mNumFaces = static_cast<unsigned>(group.triangles.size());
  out->mFaces = new aiFace[out->mNumFaces];
  for (unsigned f = 0; f < out->mNumFaces; ++f) {
    const std::uint32_t t = group.triangles[f];
    aiFace& face = out->mFaces[f];
    face.mNumIndices = 3;
    face.mIndices = new unsigned[3];
    for (std::size_t k = 0; k < 3; ++k) {
      Corner corner{mesh.triangles[t][k], 0, 0};
      if (!mesh.texcoords.empty())
        std::memcpy(&corner[1], &mesh.texcoords[t][2 * k], 2 * sizeof(float));
      const auto [entry, fresh] =
          numbers.try_emplace(corner, static_cast<std::uint32_t>(vertices.size()));
      if (fresh)
        vertices.push_back(corner);
      face.mIndices[k] = entry->second;
    }
  }
  out->mNumVertices = static_cast<unsigned>(vertices.size());
  out->mVertices = new aiVector3D[vertices.size()];
  if (!mesh.texcoords.empty()) {
    out->mTextureCoords[0] = new aiVector3D[vertices.size()];
    out->mNumUVComponents[0] = 2;
  }
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Vec3 p = mesh.points[vertices[v][0]] * scale;
    const aiVector3D q(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
    if (!std::isfinite(q.x) || !std::isfinite(q.y) || !std::isfinite(q.z))
      throw Error("a coordinate beyond single precision, expected one below 3e38");
    out->mVertices[v] = q;
    if (mesh.texcoords.empty())
      continue;
    float st[2];
    std::memcpy(st, &vertices[v][1], sizeof st);
    out->mTextureCoords[0][v] = aiVector3D(st[0], st[1], 0);
  }
  return out.release();
}

std::unique_ptr<aiScene> make_scene(const TriangleMesh& mesh, Kind kind) {
  const double scale = kind == Kind::glb ? 1e-3 : 1;
  const std::vector<Group> groups = groups_of(mesh);
  auto scene = std::make_unique<aiScene>();
  scene->mNumMeshes = static_cast<unsigned>(groups.size());
  scene->mMeshes = new aiMesh*[groups.size()]();
  std::map<std::int32_t, unsigned> materials;
  for (const Group& group : groups)
    materials.try_emplace(group.material, 0);
  scene->mNumMaterials = static_cast<unsigned>(materials.size());
  scene->mMaterials = new aiMaterial*[materials.size()]();
  unsigned next = 0;
  for (auto& [number, index] : materials) {
    index = next++;
    scene->mMaterials[index] = new aiMaterial;
    const aiString name("material" + std::to_string(number));
    scene->mMaterials[index]->AddProperty(&name, AI_MATKEY_NAME);
  }

  std::map<std::int32_t, std::vector<unsigned>> nodes; // part to its meshes
  for (unsigned g = 0; g < groups.size(); ++g) {
    scene->mMeshes[g] = make_mesh(mesh, groups[g], scale);
    scene->mMeshes[g]->mMaterialIndex = materials[groups[g].material];
    scene->mMeshes[g]->mName = "part" + std::to_string(groups[g].part);
    // The 3DS exporter orders nodes by their address, the meshes of one node as they come.
    nodes[kind == Kind::three_ds ? 0 : groups[g].part].push_back(g);
  }
  scene->mRootNode = new aiNode("mesh");
  if (kind == Kind::dae) // the exporter states a scale of the root as the file's unit
    aiMatrix4x4::Scaling(aiVector3D(0.001f), scene->mRootNode->mTransformation);
  scene->mRootNode->mNumChildren = static_cast<unsigned>(nodes.size());
  scene->mRootNode->mChildren = new aiNode*[nodes.size()]();
  next = 0;
  for (const auto& [part, meshes] : nodes) {
    aiNode* node = new aiNode("part" + std::to_string(part));
    node->mParent = scene->mRootNode;
    node->mNumMeshes = static_cast<unsigned>(meshes.size());
    node->mMeshes = new unsigned[meshes.size()];
    std::copy(meshes.begin(), meshes.end(), node->mMeshes);
    scene->mRootNode->mChildren[next++] = node;
  }
  return scene;
}

// Collada files state time and author: constants here, for reproducible bytes.
void replace_text(std::string& xml, const std::string& tag, const std::string& text) {
  const std::size_t open = xml.find("<" + tag + ">");
  if (open == std::string::npos)
    return;
  const std::size_t from = open + tag.size() + 2;
  const std::size_t to = xml.find("</" + tag + ">", from);
  if (to != std::string::npos)
    xml.replace(from, to - from, text);
}

std::string export_scene(const TriangleMesh& mesh, Kind kind) {
  const std::unique_ptr<aiScene> scene = make_scene(mesh, kind);
  const char* id = kind == Kind::glb ? "glb2" : kind == Kind::three_ds ? "3ds" : "collada";
  Assimp::Exporter exporter;
  const aiExportDataBlob* blob = exporter.ExportToBlob(scene.get(), id);
  if (blob == nullptr)
    throw Error(exporter.GetErrorString());
  std::string bytes(static_cast<const char*>(blob->data), blob->size);
  if (kind == Kind::dae) {
    const std::string unit = "meter=\"0.00100000005\""; // 0.001f as the exporter prints it
    if (const std::size_t found = bytes.find(unit); found != std::string::npos)
      bytes.replace(found, unit.size(), "meter=\"0.001\"");
    replace_text(bytes, "author", "gewebe");
    replace_text(bytes, "authoring_tool", "gewebe");
    replace_text(bytes, "created", "1970-01-01T00:00:00");
    replace_text(bytes, "modified", "1970-01-01T00:00:00");
  }
  return bytes;
}

} // namespace

double collada_metres(std::string_view bytes) {
  const std::size_t asset = bytes.find("<asset");
  const std::size_t unit = bytes.find("<unit", asset == std::string_view::npos ? 0 : asset);
  if (asset == std::string_view::npos || unit == std::string_view::npos)
    return 1;
  const std::string_view tag = bytes.substr(unit, bytes.find('>', unit) - unit);
  const std::size_t name = tag.find("meter=");
  if (name == std::string_view::npos || name + 8 > tag.size())
    return 1;
  double metres = 0;
  (void)std::from_chars(tag.data() + name + 7, tag.data() + tag.size(), metres);
  return metres > 0 && std::isfinite(metres) ? metres : 1;
}

TriangleMesh read_by_assimp(const AssimpSource& source, AssimpStats* stats) {
  const std::string shown = format_of(source.kind).shown;
  try {
    const std::string wire = run_in_child(
        [&] {
          AssimpStats counts;
          const TriangleMesh mesh = import(source, counts);
          return to_wire(mesh, counts);
        },
        limits_for(source.bytes.size()));
    return from_wire(wire, stats);
  } catch (const Error& error) {
    std::string fault = one_line(error.what());
    if (fault == out_of_memory && has_room_for_child(limits_for(source.bytes.size())))
      fault = one_line(fault_of_size(source));
    throw Error("not readable as " + shown + ": " + fault + ", expected a valid " + shown +
                " file");
  }
}

std::string write_by_assimp(const TriangleMesh& mesh, Kind kind) {
  if (kind != Kind::glb && kind != Kind::three_ds && kind != Kind::dae)
    throw Error("assimp does not write " + std::string(kind_name(kind)) + " for us");
  const std::string shown = format_of(kind).shown;
  if (mesh.triangles.empty())
    throw Error("no triangle to write as " + shown + ", expected at least one");
  try {
    return run_in_child([&] { return export_scene(mesh, kind); },
                        limits_for(mesh.triangles.size() * 64));
  } catch (const Error& error) {
    throw Error("not writable as " + shown + ": " + one_line(error.what()));
  }
}

} // namespace gewebe::formats
