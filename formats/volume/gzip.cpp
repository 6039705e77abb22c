#include "formats/volume/gzip_internal.h"

#include "base/error.h"

namespace gewebe::formats {

GzipWriter::GzipWriter(const std::function<void(std::string_view)>& sink) : sink_(sink) {
  if (deflateInit2(&stream_, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw Error("zlib can't begin to pack, expected memory for it");
}

GzipWriter::~GzipWriter() {
  deflateEnd(&stream_);
}

void GzipWriter::pack(std::string_view bytes, int flush) {
  // zlib does not write there.
  stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream_.avail_in = static_cast<uInt>(bytes.size());
  do {
    stream_.next_out = reinterpret_cast<Bytef*>(out_.data());
    stream_.avail_out = static_cast<uInt>(out_.size());
    if (deflate(&stream_, flush) == Z_STREAM_ERROR)
      throw Error("zlib can't pack");
    sink_({out_.data(), out_.size() - stream_.avail_out});
  } while (stream_.avail_out == 0);
}

} // namespace gewebe::formats
