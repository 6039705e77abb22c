#pragma once
// Streams in gzip's format, for files that are written.

#include <zlib.h>

#include <array>
#include <functional>
#include <string_view>

namespace gewebe::formats {

/// Packs bytes for a sink, which it does not outlive. The head has neither time nor name.
class GzipWriter {
public:
  /// \throw Error if zlib lacks memory
  explicit GzipWriter(const std::function<void(std::string_view)>& sink);
  ~GzipWriter();
  GzipWriter(const GzipWriter&) = delete;
  GzipWriter& operator=(const GzipWriter&) = delete;

  void write(std::string_view bytes) { pack(bytes, Z_NO_FLUSH); }
  void finish() { pack({}, Z_FINISH); }

private:
  void pack(std::string_view bytes, int flush);

  const std::function<void(std::string_view)>& sink_;
  z_stream stream_{};
  std::array<char, 1 << 16> out_{};
};

} // namespace gewebe::formats
