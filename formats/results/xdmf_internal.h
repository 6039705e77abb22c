#pragma once
// Pieces of an XDMF file that refers to arrays of an HDF5 file beside it.

#include <cstdint>
#include <string>

namespace gewebe {

class XdmfText {
public:
  /// \param file the HDF5 file's name, without folder
  explicit XdmfText(const std::string& file);

  /// A whole array; `type` has its attributes NumberType and Precision.
  std::string array(const std::string& path, const std::string& dimensions, const char* type) const;
  /// One of the `count` rows of an array of floats of `bytes` bytes; its shape is `dimensions`, one
  /// or two numbers.
  std::string row(const std::string& path, std::uint64_t row, std::uint64_t count,
                  const std::string& dimensions, int bytes = 4) const;
  /// The same as an attribute. `type` is "Vector", say, `center` "Node", "Cell" or "Grid".
  std::string attribute(const char* name, const char* type, const char* center,
                        const std::string& row) const;
  std::string topology(const char* type, const std::string& path, std::uint64_t count,
                       std::uint64_t nodes) const;

private:
  std::string file_; ///< with what XML wants quoted
};

} // namespace gewebe
