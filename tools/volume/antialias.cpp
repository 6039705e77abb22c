#include "tools/volume/antialias.h"

#include "antialiasing/distance_ramp.h"
#include "tools/cli/filling_rule.h"

#include <charconv>
#include <optional>

namespace gewebe::cli {
namespace {

constexpr int lines_instead = 4; ///< N of lines:N where exact cannot be

} // namespace

AntialiasChoice antialias_from_text(const std::string& text) {
  if (text == "exact")
    return {Antialias::exact};
  if (text == "jones")
    return {Antialias::jones};
  if (text == "sramek")
    return {Antialias::sramek};
  if (text == "none")
    return {Antialias::none};
  const std::size_t colon = text.find_first_of(":=");
  const std::string word = text.substr(0, colon);
  if (colon != std::string::npos && (word == "box" || word == "lines")) {
    int n = 0;
    const char* const end = text.data() + text.size();
    if (const auto [rest, error] = std::from_chars(text.data() + colon + 1, end, n);
        error == std::errc() && rest == end && n >= 1 && n <= 64)
      return {word == "box" ? Antialias::box : Antialias::lines, n};
  }
  throw UsageError(
      "--antialias: '" + text +
      "' is unknown, expected exact, lines:N, box:N, jones, sramek or none, N 1 to 64");
}

volume::Grid antialiased(cli::Run& run, const std::string& place, const TriangleMesh& mesh,
                         const volume::GridTransform& transform, const AntialiasChoice& choice,
                         const voxelization::VoxelizeOptions& options,
                         antialiasing::CoverageReport& report) {
  const Context& context = run.context();
  const voxelization::OpenMesh on_open = options.on_open;
  std::string instead;
  const auto volume = [&]() -> volume::Grid {
    switch (choice.filter) {
    case Antialias::exact:
      if (std::optional<volume::Grid> grid =
              antialiasing::exact_coverage(context, mesh, transform, on_open, &report))
        return *std::move(grid);
      instead = report.mesh.boundary_edges > 0 && on_open == voxelization::OpenMesh::skip
                    ? ""
                    : "its faces have no orientation";
      instead += (instead.empty() ? "lines:" : "; lines:") + std::to_string(lines_instead) +
                 " instead of exact";
      return antialiasing::line_coverage(context, mesh, transform, lines_instead, on_open, &report);
    case Antialias::lines:
      return antialiasing::line_coverage(context, mesh, transform, choice.count, on_open, &report);
    case Antialias::jones:
      return antialiasing::jones_density(context, mesh, transform, on_open, &report, options.rule);
    case Antialias::sramek:
      return antialiasing::sramek_density(context, mesh, transform, on_open, &report, options.rule);
    default:
      break;
    }
    voxelization::VoxelizeOptions sampled = options;
    sampled.samples = choice.filter == Antialias::box ? choice.count : 1;
    const voxelization::InsideScan scan = run.timed("scan", [&] {
      return voxelization::scan_inside(context, mesh, transform, sampled, &report.mesh);
    });
    return run.timed("grid",
                     [&] { return voxelization::grid_from_scan(context, scan, transform); });
  };
  volume::Grid grid = at(place, volume);
  std::string warning = mesh_defects(report.mesh, options);
  if (!instead.empty())
    warning += (warning.empty() ? "" : "; ") + instead;
  if (!warning.empty())
    run.warn(place + ": " + warning);
  return grid;
}

} // namespace gewebe::cli
