#pragma once
// Arrays that go to the script of a peer and come back, in a temporary folder.

#include "base/error.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <system_error>
#include <unistd.h>
#include <vector>

namespace gewebe::validate {

/// A folder that goes when it is no longer wanted.
struct Folder {
  std::filesystem::path path;
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "gewebe-validate-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr)
      throw Error("no temporary folder can be made");
    path = name;
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code ignored;
    (void)std::filesystem::remove_all(path, ignored);
  }
};

/// Numbers as they are in memory.
template <class T>
void write(const Folder& folder, const char* name, std::span<const T> values) {
  std::ofstream file(folder.path / name, std::ios::binary);
  file.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size_bytes()));
  if (!file.flush())
    throw Error("a file for the peer can't be written");
}
template <class T>
std::vector<T> read(const Folder& folder, const char* name) {
  std::ifstream file(folder.path / name, std::ios::binary);
  if (!file)
    throw Error(std::string("the peer wrote no ") + name);
  std::vector<T> values(std::filesystem::file_size(folder.path / name) / sizeof(T));
  file.read(reinterpret_cast<char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(T)));
  return values;
}

} // namespace gewebe::validate
