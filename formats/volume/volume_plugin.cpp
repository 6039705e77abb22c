#include "formats/volume/volume_plugin.h"

#include "base/error.h"
#include "formats/volume/volume_plugin_internal.h"

#include <dlfcn.h>
#include <filesystem>
#include <string_view>

namespace gewebe::formats {
namespace {

constexpr const char* library_name = "gewebe-volume.so";

void* load() {
  std::error_code failure;
  const std::filesystem::path here =
      std::filesystem::read_symlink("/proc/self/exe", failure).parent_path();
  for (const std::filesystem::path& path :
       {here / library_name, here / "../lib/gewebe" / library_name}) {
    if (!std::filesystem::exists(path, failure))
      continue;
    if (void* library = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL))
      return library;
    const char* why = ::dlerror();
    throw Error(std::string("cannot load ") + library_name + ": " + (why != nullptr ? why : ""));
  }
  throw Error(std::string(library_name) +
              " is missing, expected beside the program or in ../lib/gewebe");
}

/// A function of the library by its name. \throw Error if it is missing or of another version
template <class Function>
Function* function_named(const char* name) {
  static void* const library = load();
  const auto* version = static_cast<const char* const*>(::dlsym(library, "gewebe_volume_version"));
  // POSIX: a function's address comes as an object's.
  auto* const found = reinterpret_cast<Function*>(::dlsym(library, name));
  if (version == nullptr || found == nullptr || std::string_view(*version) != GEWEBE_VERSION)
    throw Error(std::string(library_name) + " is of another version, expected " GEWEBE_VERSION);
  return found;
}

} // namespace

shading::VolumeView view_volume_bytes(std::string bytes, const std::string& name,
                                      const shading::VolumeViewOptions& options,
                                      const Context& context) {
  return gewebe::at(name, [&] {
    shading::VolumeView view;
    function_named<decltype(gewebe_view_volume)>("gewebe_view_volume")(&bytes, &name, &options,
                                                                       &context, &view);
    return view;
  });
}

FilledSurface fill_surface(const TriangleMesh& mesh, const std::string& name,
                           const SurfaceFilling& filling, const Context& context) {
  return gewebe::at(name, [&] {
    FilledSurface filled;
    function_named<decltype(gewebe_fill_surface)>("gewebe_fill_surface")(&mesh, &name, &filling,
                                                                         &context, &filled);
    return filled;
  });
}

} // namespace gewebe::formats
