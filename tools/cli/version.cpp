#include "tools/cli/version.h"

#include "base/cpu.h"
#include "base/error.h"
#include "repair/repair.h"

#include <array>
#include <cstdlib>
#include <string_view>

#include <CGAL/version.h>
#include <assimp/version.h>
#include <cholmod.h>
#include <hdf5.h>
#include <oneapi/tbb/version.h>
#include <openvdb/version.h>
#include <png.h>
#include <zlib.h>

// A weak reference loads nothing: it is null in a program that does without that library.
#pragma weak aiGetVersionMajor
#pragma weak aiGetVersionMinor
#pragma weak aiGetVersionPatch
#pragma weak cholmod_version
#pragma weak H5get_libversion
#pragma weak png_access_version_number
#pragma weak TBB_runtime_version
#pragma weak zlibVersion
extern "C" const char gewebe_commit[] __attribute__((weak)); // of programs, see the Makefile
namespace openvdb::OPENVDB_VERSION_NAME {
void initialize() __attribute__((weak));
}
namespace gewebe::repair { // CGAL is headers alone: it is there with what uses them
// NOLINTNEXTLINE(readability-redundant-declaration): it makes the reference weak
RepairReport repair_mesh(TriangleMesh& mesh, const RepairOptions& options, const Context& context)
    __attribute__((weak));
} // namespace gewebe::repair

namespace gewebe::cli {
namespace {

std::string dotted(unsigned major, unsigned minor, unsigned patch) {
  return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(patch);
}

std::string libraries() {
  std::string list;
  const auto add = [&](std::string_view name, std::string_view version) {
    (((list += list.empty() ? "" : ", ") += name) += ' ') += version;
  };
  if (aiGetVersionMajor != nullptr)
    add("assimp", dotted(aiGetVersionMajor(), aiGetVersionMinor(), aiGetVersionPatch()));
  if (repair::repair_mesh != nullptr)
    add("CGAL", CGAL_VERSION_STR);
  if (cholmod_version != nullptr) {
    std::array<int, 3> version{};
    (void)cholmod_version(version.data());
    const auto [major, minor, patch] = version;
    add("CHOLMOD", dotted(static_cast<unsigned>(major), static_cast<unsigned>(minor),
                          static_cast<unsigned>(patch)));
  }
  unsigned major = 0, minor = 0, patch = 0;
  if (H5get_libversion != nullptr && H5get_libversion(&major, &minor, &patch) >= 0)
    add("HDF5", dotted(major, minor, patch));
  if (png_access_version_number != nullptr) { // 10639 is 1.6.39
    const png_uint_32 version = png_access_version_number();
    add("libpng", dotted(version / 10000, version / 100 % 100, version % 100));
  }
  if (TBB_runtime_version != nullptr)
    add("oneTBB", TBB_runtime_version());
  if (openvdb::initialize != nullptr)
    add("OpenVDB", OPENVDB_LIBRARY_VERSION_STRING);
  if (zlibVersion != nullptr)
    add("zlib", zlibVersion());
  return list;
}

} // namespace

std::string version_text(const std::string& tool) {
  std::string text = tool + " (Gewebe) " GEWEBE_VERSION;
  if (gewebe_commit != nullptr && gewebe_commit[0] != '\0')
    text += std::string(", commit ") + gewebe_commit;
  CpuLevel level = best_cpu_level();
  if (const char* wanted = std::getenv("GEWEBE_CPU"); wanted != nullptr && *wanted != '\0')
    level = at("GEWEBE_CPU", [&] { return cpu_level_from_name(wanted); });
  if (const std::string list = libraries(); !list.empty())
    text += "\nlibraries: " + list;
  return ((text += "\nkernels: ") += cpu_level_name(level)) + "\n";
}

} // namespace gewebe::cli
