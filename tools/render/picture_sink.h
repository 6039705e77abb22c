#pragma once
// Where pictures go: a file or stream, a file for each frame, or a film.

#include "formats/image/film.h"
#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "texture/image.h"
#include "tools/cli/cli.h"

#include <cstdint>
#include <optional>
#include <string>

namespace gewebe::cli {

class PictureSink {
public:
  /// \param numbered_files  the output's name is a pattern for numbers of frames
  /// \param rate  pictures per second of a film
  PictureSink(Run& run, formats::Kind kind, bool numbered_files, double rate);
  /// \throw UsageError if one file cannot take so many pictures
  void expect(std::size_t pictures) const;
  /// \param same  whether the picture is that before it
  void put(const texture::Image& picture, bool same, std::int64_t frame);
  void commit();

private:
  Run& run_;
  formats::Kind kind_;
  bool numbered_;
  double rate_;
  std::optional<formats::Output> output_; ///< none where each frame has its own
  std::optional<formats::FilmWriter> film_;
  std::string bytes_; ///< of the last picture
};

} // namespace gewebe::cli
