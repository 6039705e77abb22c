#include "formats/stream/kind.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

namespace gewebe::formats {
namespace {

constexpr std::array<std::pair<Kind, std::string_view>, 34> names{{
    {Kind::particles, "particles"},
    {Kind::vdb, "vdb"},
    {Kind::ply, "ply"},
    {Kind::ela, "ela"},
    {Kind::hdf5, "h5"},
    {Kind::nifti, "nii"},
    {Kind::obj, "obj"},
    {Kind::stl, "stl"},
    {Kind::off, "off"},
    {Kind::dxf, "dxf"},
    {Kind::gltf, "gltf"},
    {Kind::glb, "glb"},
    {Kind::three_ds, "3ds"},
    {Kind::dae, "dae"},
    {Kind::vtu, "vtu"},
    {Kind::vtp, "vtp"},
    {Kind::msh, "msh"},
    {Kind::msh4, "msh4"},
    {Kind::medit, "medit"},
    {Kind::tetgen, "tetgen"},
    {Kind::png, "png"},
    {Kind::ppm, "ppm"},
    {Kind::csv, "csv"},
    {Kind::vtkhdf, "vtkhdf"},
    {Kind::html, "html"},
    {Kind::nrrd, "nrrd"},
    {Kind::mha, "mha"},
    {Kind::vtk, "vtk"},
    {Kind::inp, "inp"},
    {Kind::feb, "feb"},
    {Kind::mp4, "mp4"},
    {Kind::webm, "webm"},
    {Kind::svg, "svg"},
    {Kind::ascii, "ascii"},
}};

/// The suffix of a path that names a kind, though none of ours: up to five letters and digits, not
/// digits alone, which number files. Empty for what people call files whose kind is said elsewhere.
std::string_view foreign_suffix(std::string_view path) {
  const std::size_t slash = path.find_last_of('/') + 1; // 0 if there is none
  const std::size_t dot = path.find_last_of('.');
  if (dot == std::string_view::npos || dot <= slash)
    return {};
  const std::string_view suffix = path.substr(dot + 1);
  const auto is = [](int (*test)(int)) {
    return [test](char c) { return test(static_cast<unsigned char>(c)) != 0; };
  };
  if (suffix.size() > 5 || !std::ranges::any_of(suffix, is(std::isalpha)) ||
      !std::ranges::all_of(suffix, is(std::isalnum)))
    return {};
  constexpr std::array<std::string_view, 10> plain{"tmp", "part", "new", "old", "bak",
                                                   "out", "dat",  "bin", "txt", "log"};
  return std::ranges::find(plain, suffix) == plain.end() ? suffix : std::string_view();
}

/// The first word of a text, after blank lines and # comments.
std::string_view first_word(std::string_view text) {
  std::size_t at = 0;
  while (at < text.size()) {
    if (text[at] == '#') {
      at = text.find('\n', at);
      if (at == std::string_view::npos)
        return {};
    } else if (std::isspace(static_cast<unsigned char>(text[at])) != 0) {
      ++at;
    } else {
      break;
    }
  }
  std::size_t end = at;
  while (end < text.size() && std::isspace(static_cast<unsigned char>(text[end])) == 0)
    ++end;
  return text.substr(at, end - at);
}

/// What a file of VTK in XML holds, by its outermost tag, with which `text` begins.
Kind vtk_kind(std::string_view text) {
  const std::string_view tag = text.substr(0, text.find('>'));
  const auto says = [&](const char* word) {
    for (const char* const quote : {"\"", "'"})
      if (tag.find(quote + std::string(word) + quote) != std::string_view::npos)
        return true;
    return false;
  };
  return says("UnstructuredGrid") ? Kind::vtu : says("PolyData") ? Kind::vtp : Kind::unknown;
}

} // namespace

std::string_view kind_name(Kind kind) {
  if (kind == Kind::rgb)
    return "rgb";
  for (const auto& [value, name] : names)
    if (value == kind)
      return name;
  return "unknown";
}

std::string kind_list(const std::vector<Kind>& kinds) {
  std::string text;
  for (const Kind kind : kinds) {
    if (!text.empty())
      text += ", ";
    text += kind_name(kind);
  }
  return text;
}

Kind kind_from_name(std::string_view name) {
  if (name == "mesh")
    return Kind::ply;
  if (name == "rgb")
    return Kind::rgb;
  for (const auto& [kind, text] : names)
    if (text == name)
      return kind;
  return Kind::unknown;
}

Kind kind_from_suffix(std::string_view path) {
  const std::size_t slash = path.find_last_of('/');
  if (slash != std::string_view::npos)
    path.remove_prefix(slash + 1);
  std::string lower(path);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (lower.ends_with(".nii.gz"))
    return Kind::nifti;
  const std::size_t dot = lower.find_last_of('.');
  if (dot == std::string::npos)
    return Kind::unknown;
  const std::string suffix = lower.substr(dot + 1);
  if (suffix == "hdf5")
    return Kind::hdf5;
  if (suffix == "mesh")
    return Kind::medit;
  if (suffix == "node" || suffix == "ele")
    return Kind::tetgen;
  if (suffix == "txt" || suffix == "msh4" || suffix == "medit" || suffix == "tetgen" ||
      suffix == "ascii")
    return Kind::unknown;
  return kind_from_name(suffix);
}

Kind kind_from_magic(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("ply\n"sv) || bytes.starts_with("ply\r"sv))
    return Kind::ply;
  if (bytes.starts_with("\x20\x42\x44\x56\0\0\0\0"sv))
    return Kind::vdb;
  if (bytes.starts_with("\x89HDF\r\n\x1a\n"sv))
    return Kind::hdf5;
  if (bytes.starts_with("glTF"sv))
    return Kind::glb;
  if (bytes.starts_with("\x89PNG\r\n\x1a\n"sv))
    return Kind::png;
  if (bytes.size() >= 348 &&
      (bytes.substr(344, 4) == "n+1\0"sv || bytes.substr(344, 4) == "ni1\0"sv))
    return Kind::nifti;
  if (bytes.starts_with("$MeshFormat") || bytes.starts_with("$Comments") ||
      bytes.starts_with("$NOD"))
    return Kind::msh;
  if (bytes.starts_with("# vtk DataFile Version"))
    return Kind::vtk;
  if (const std::size_t at = bytes.find("<VTKFile");
      at != std::string_view::npos && first_word(bytes).starts_with('<'))
    if (const Kind kind = vtk_kind(bytes.substr(at)); kind != Kind::unknown)
      return kind;
  const std::string_view word = first_word(bytes);
  if (word == "MeshVersionFormatted")
    return Kind::medit;
  if (word == "ela_expl")
    return Kind::ela;
  return Kind::unknown;
}

Kind input_kind(std::string_view peeked, std::string_view path, std::string_view format) {
  const Kind asked = format.empty() ? Kind::unknown : kind_from_name(format);
  if (!format.empty() && asked == Kind::unknown)
    throw UsageError("--format: no kind '" + std::string(format) + "'");
  if (const Kind proven = kind_from_magic(peeked); proven != Kind::unknown)
    return proven;
  if (asked != Kind::unknown)
    return asked;
  return kind_from_suffix(path);
}

Kind output_kind(std::string_view to, std::string_view path, Kind fallback,
                 const std::vector<Kind>& writable) {
  Kind kind = fallback;
  if (!to.empty()) {
    kind = kind_from_name(to);
  } else if (const Kind suffix = kind_from_suffix(path); suffix != Kind::unknown) {
    kind = suffix;
  } else if (const std::string_view foreign = foreign_suffix(path); !foreign.empty()) {
    throw UsageError(std::string(path) + ": cannot write ." + std::string(foreign) +
                     ", expected --to or a suffix of " + kind_list(writable));
  }
  if (std::ranges::find(writable, kind) == writable.end()) {
    const std::string asked = to.empty() ? std::string(kind_name(kind)) : std::string(to);
    throw UsageError("cannot write " + asked + ", expected one of " + kind_list(writable));
  }
  return kind;
}

bool is_binary(Kind kind) {
  return kind != Kind::particles && kind != Kind::ela && kind != Kind::obj && kind != Kind::off &&
         kind != Kind::dxf && kind != Kind::gltf && kind != Kind::dae && kind != Kind::csv &&
         kind != Kind::msh && kind != Kind::medit && kind != Kind::tetgen && kind != Kind::html &&
         kind != Kind::inp && kind != Kind::feb && kind != Kind::svg && kind != Kind::ascii;
}

} // namespace gewebe::formats
