#include "tools/render/surface_file.h"

#include "base/error.h"
#include "fem/solid_model.h"
#include "formats/mesh/mesh_file.h"
#include "formats/model/ela.h"
#include "formats/results/results.h"
#include "formats/tetrahedra/tet_file.h"
#include "tetrahedra/order.h"
#include "tools/render/result_surfaces.h"
#include "tools/render/solid_surface.h"

#include <algorithm>
#include <charconv>
#include <utility>

namespace gewebe::cli {
namespace {

std::vector<shading::Surface> one(TriangleMesh mesh) {
  std::vector<shading::Surface> surfaces(1);
  surfaces[0].mesh = std::move(mesh);
  return surfaces;
}

std::int64_t whole_number(const formats::Input& input, const std::string& word,
                          const std::string& part) {
  std::int64_t value = 0;
  const auto [rest, status] = std::from_chars(part.data(), part.data() + part.size(), value);
  if (status != std::errc{} || rest != part.data() + part.size())
    throw UsageError(input.name(), "--frames: '" + word + "', expected all, K, A:B or A:B:STEP");
  return value;
}

constexpr const char* no_tetrahedra =
    "--clip for what has no tetrahedra, expected a tetrahedral mesh (mc-opt --tets makes one)";

TriangleMesh open_model(const model::Model& model, const tetrahedra::ClipPlane& plane,
                        SolidReport& report) {
  tetrahedra::TetMesh mesh = fem::element_mesh(model);
  examine_solid(mesh, report);
  return open_mesh(tetrahedra::linear_parts(std::move(mesh)), plane, report);
}

void refuse(bool wrong, const formats::Input& input, const char* what) {
  if (wrong)
    throw UsageError(input.name(), what);
}

} // namespace

std::vector<std::int64_t> result_frames(const formats::Input& input, const std::string& word) {
  if (input.name() == "-")
    throw Error(input.name(), "a result comes by a pipe, expected the name of its file");
  const auto count =
      static_cast<std::int64_t>(formats::read_result_index(input.name()).times.size());
  std::vector<std::int64_t> parts;
  if (word == "all")
    parts = {0, -1};
  else
    for (std::size_t from = 0; from <= word.size();) {
      const std::size_t end = std::min(word.find(':', from), word.size());
      parts.push_back(whole_number(input, word, word.substr(from, end - from)));
      from = end + 1;
    }
  if (parts.size() > 3 || (parts.size() == 3 && parts[2] < 1))
    throw UsageError(input.name(),
                     "--frames: '" + word + "', expected all, K, A:B or A:B:STEP, STEP at least 1");
  const auto from_start = [&](std::int64_t k) { return k < 0 ? k + count : k; };
  const std::int64_t first = from_start(parts[0]),
                     last = from_start(parts.size() > 1 ? parts[1] : parts[0]);
  if (first < 0 || last >= count || first > last)
    throw Error(input.name(), "there are no frames " + word + ", expected some of 0 to " +
                                  std::to_string(count - 1));
  std::vector<std::int64_t> frames;
  const std::int64_t step = parts.size() > 2 ? parts[2] : 1;
  for (std::int64_t k = first;; k += step) {
    frames.push_back(k);
    if (last - k < step)
      return frames;
  }
}

const std::vector<formats::Kind>& readable_surface_kinds() {
  static const std::vector<formats::Kind> kinds = [] {
    std::vector<formats::Kind> all = formats::readable_mesh_kinds();
    for (const formats::Kind kind : formats::readable_tet_kinds())
      if (std::ranges::find(all, kind) == all.end()) // PLY is both
        all.push_back(kind);
    all.push_back(formats::Kind::ela);
    all.push_back(formats::Kind::hdf5);
    return all;
  }();
  return kinds;
}

const std::vector<std::string>& surface_unit_names() {
  return formats::mesh_unit_names();
}

std::vector<shading::Surface> read_surfaces(formats::Input& input,
                                            const SurfaceReadOptions& options,
                                            const Context& context, SolidReport* solid) {
  const bool is_result = options.kind == formats::Kind::hdf5,
             is_model = options.kind == formats::Kind::ela;
  refuse(!is_result && (!options.object.empty() || options.frame), input,
         "--object or --frame for no result of a run, expected neither");
  refuse((is_result || is_model) && !options.unit.empty(), input,
         "--unit for what is in mm, expected no --unit");
  const bool is_solid = formats::holds_tetrahedra(input.peek(4096), options.kind);
  refuse(!is_solid && !is_result && !is_model && options.clip, input, no_tetrahedra);
  refuse(!is_result && !options.field.empty(), input,
         "--field for no result of a run, expected no --field");
  SolidReport unused;
  SolidReport& report = solid == nullptr ? unused : *solid;
  report = {};
  if (is_solid) {
    std::vector<shading::Surface> surfaces;
    surfaces.push_back(read_solid(input, options, report, context));
    return surfaces;
  }
  if (is_result)
    return read_result_surfaces(input, options, report);
  if (is_model) {
    const model::Model model = formats::read_ela(input, context);
    refuse(model.tetrahedra.empty() && options.clip, input, no_tetrahedra);
    std::vector<shading::Surface> surfaces = one(
        options.clip ? at(input.name(), [&] { return open_model(model, *options.clip, report); })
                     : model::shown_mesh(model));
    for (const model::Material& material : model.materials)
      surfaces[0].materials.push_back(material.name);
    return surfaces;
  }
  formats::MeshReadOptions reading;
  reading.kind = options.kind;
  reading.unit = options.unit;
  reading.max_memory = context.max_memory;
  return one(formats::read_mesh(input, reading));
}

} // namespace gewebe::cli
