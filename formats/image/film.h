#pragma once
// Films, coded by the program ffmpeg.

#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "texture/image.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gewebe::formats {

/// mp4 (H.264) and webm (VP9).
const std::vector<Kind>& film_kinds();

struct FilmOptions {
  Kind kind = Kind::mp4;
  std::uint32_t width = 0, height = 0; ///< even
  double rate = 25;                    ///< pictures per second
};

/// A film under construction: ffmpeg writes the temporary file of an output, which outlives this.
/// Without finish() ffmpeg is ended, and the output stays without its film.
class FilmWriter {
public:
  /// \throw Error with place: odd sides; an output that is no regular file; no ffmpeg, with the
  /// command that codes a stream of pictures elsewhere
  FilmWriter(Output& output, const FilmOptions& options);
  ~FilmWriter();
  FilmWriter(const FilmWriter&) = delete;
  FilmWriter& operator=(const FilmWriter&) = delete;

  /// \pre three channels and the size of the film \throw Error if ffmpeg ended
  void add(const texture::Image& picture);
  /// Waits for ffmpeg; the caller commits. \throw Error if it failed
  void finish();

private:
  void wait_for_end();
  const Output& output_;
  int socket_ = -1;
  int child_ = -1; ///< process
  int status_ = 0;
};

} // namespace gewebe::formats
