#include "tools/render/picture_sink.h"

#include "base/error.h"
#include "formats/image/image_file.h"
#include "tools/render/frame_name.h"

#include <algorithm>

namespace gewebe::cli {

PictureSink::PictureSink(Run& run, formats::Kind kind, bool numbered_files, double rate)
    : run_(run), kind_(kind), numbered_(numbered_files), rate_(rate) {
  if (!numbered_)
    output_.emplace(run.output(), run.output_options(true));
}

void PictureSink::expect(std::size_t pictures) const {
  if (pictures > 1 && !numbered_ && run_.output() != "-" && kind_ == formats::Kind::png)
    throw UsageError(run_.output() + ": " + std::to_string(pictures) +
                     " pictures for one file, expected %d or %04d in its name, --to rgb, mp4 or "
                     "webm, or -o - for a stream");
}

void PictureSink::put(const texture::Image& picture, bool same, std::int64_t frame) {
  if (std::ranges::find(formats::film_kinds(), kind_) != formats::film_kinds().end()) {
    if (!film_)
      film_.emplace(*output_, formats::FilmOptions{kind_, picture.width, picture.height, rate_});
    return film_->add(picture);
  }
  if (kind_ != formats::Kind::rgb && !same)
    bytes_ = formats::image_bytes(picture, kind_);
  const auto write = [&](formats::Output& output) {
    return kind_ == formats::Kind::rgb ? formats::write_image(output, picture, kind_)
                                       : output.write(bytes_);
  };
  if (!numbered_)
    return write(*output_);
  formats::Output output(numbered(run_.output(), frame), run_.output_options(true));
  write(output);
  output.commit();
}

void PictureSink::commit() {
  if (film_)
    film_->finish();
  if (output_)
    output_->commit();
}

} // namespace gewebe::cli
