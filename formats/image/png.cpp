#include "formats/image/png.h"

#include "base/error.h"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>

// libpng leaves its calls by longjmp. Functions that call it hold nothing with a destructor; what
// they share stands in a Job that lives outside.

namespace gewebe::formats {
namespace {

constexpr png_uint_32 max_side = 32768;
// Deflate makes at most 1032 bytes of one.
constexpr double max_expansion = 1032;

struct Job {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::array<char, 128> message{};
  // reading
  std::string_view bytes;
  std::size_t at = 0;
  png_uint_32 width = 0, height = 0;
  png_byte channels = 0;
  std::size_t row_bytes = 0;
  int passes = 1;
  bool deep = false; // 16 bits a value, in the order of this machine
  // writing
  std::string* out = nullptr;
};

void keep(Job& job, const char* message) {
  std::strncpy(job.message.data(), message, job.message.size() - 1);
}

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  keep(*static_cast<Job*>(png_get_error_ptr(png)), message);
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

void give(png_structp png, png_bytep to, std::size_t count) {
  Job& job = *static_cast<Job*>(png_get_io_ptr(png));
  if (count > job.bytes.size() - job.at) {
    job.at = job.bytes.size();
    png_error(png, "the file ends too early");
  }
  std::memcpy(to, job.bytes.data() + job.at, count);
  job.at += count;
}

void take(png_structp png, png_bytep from, std::size_t count) {
  Job& job = *static_cast<Job*>(png_get_io_ptr(png));
  bool stored = false;
  try {
    job.out->append(reinterpret_cast<const char*>(from), count);
    stored = true;
  } catch (const std::exception&) { // must not pass through C
  }
  if (!stored)
    png_error(png, "no memory");
}

void flush(png_structp) {}

/// Reads up to the first pixel and decides what a row will be.
bool read_head(Job& job) {
  if (setjmp(png_jmpbuf(job.png)) != 0)
    return false;
  png_set_read_fn(job.png, &job, give);
  png_set_user_limits(job.png, max_side, max_side);
  png_read_info(job.png, job.info);
  const png_byte type = png_get_color_type(job.png, job.info);
  if (type == PNG_COLOR_TYPE_PALETTE)
    png_set_palette_to_rgb(job.png);
  else if (type == PNG_COLOR_TYPE_GRAY && png_get_bit_depth(job.png, job.info) < 8)
    png_set_expand_gray_1_2_4_to_8(job.png);
  if (job.deep) {
    png_set_expand_16(job.png);
    if constexpr (std::endian::native == std::endian::little)
      png_set_swap(job.png);
  } else {
    png_set_scale_16(job.png);
  }
  png_set_strip_alpha(job.png);
  job.passes = png_set_interlace_handling(job.png);
  png_read_update_info(job.png, job.info);
  job.width = png_get_image_width(job.png, job.info);
  job.height = png_get_image_height(job.png, job.info);
  job.channels = png_get_channels(job.png, job.info);
  job.row_bytes = png_get_rowbytes(job.png, job.info);
  return true;
}

bool read_rows(Job& job, png_byte* pixels) {
  if (setjmp(png_jmpbuf(job.png)) != 0)
    return false;
  for (int pass = 0; pass < job.passes; ++pass)
    for (png_uint_32 y = 0; y < job.height; ++y)
      png_read_row(job.png, pixels + y * job.row_bytes, nullptr);
  png_read_end(job.png, nullptr);
  return true;
}

bool write_all(Job& job, const texture::Image& image) {
  if (setjmp(png_jmpbuf(job.png)) != 0)
    return false;
  png_set_write_fn(job.png, &job, take, flush);
  png_set_user_limits(job.png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  // Of pictures made here nearly as small as level 6 with all filters, in a fifth of the time.
  png_set_compression_level(job.png, 1);
  png_set_compression_strategy(job.png, Z_RLE);
  png_set_filter(job.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_PAETH);
  png_set_IHDR(job.png, job.info, image.width, image.height, 8,
               image.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(job.png, job.info);
  const std::size_t row = std::size_t{image.width} * image.channels;
  for (std::size_t y = 0; y < image.height; ++y)
    png_write_row(job.png, image.values.data() + y * row);
  png_write_end(job.png, job.info);
  return true;
}

/// A Job's structures of libpng, for reading or writing.
class Session {
public:
  explicit Session(Job& job, bool reading) : job_(job), reading_(reading) {
    job.png = reading ? png_create_read_struct(PNG_LIBPNG_VER_STRING, &job, on_error, on_warning)
                      : png_create_write_struct(PNG_LIBPNG_VER_STRING, &job, on_error, on_warning);
    if (job.png != nullptr)
      job.info = png_create_info_struct(job.png);
    if (job.info == nullptr) {
      close();
      throw Error("libpng gives no memory");
    }
  }
  ~Session() { close(); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

private:
  void close() {
    if (reading_)
      png_destroy_read_struct(&job_.png, &job_.info, nullptr);
    else
      png_destroy_write_struct(&job_.png, &job_.info);
  }
  Job& job_;
  bool reading_;
};

[[noreturn]] void fail(const Job& job, const std::string& name) {
  throw Error(name, "byte " + std::to_string(job.at) + ": " + job.message.data() +
                        ", expected a sound PNG");
}

template <class Value>
texture::Pixels<Value> read(std::string_view bytes, const std::string& name) {
  Job job;
  job.bytes = bytes;
  job.deep = sizeof(Value) == 2;
  const Session session(job, true);
  if (!read_head(job))
    fail(job, name);
  const double pixels = static_cast<double>(job.width) * job.height;
  // A pixel takes a bit at least.
  if (pixels / 8 > max_expansion * static_cast<double>(bytes.size()))
    throw Error(name, std::to_string(job.width) + " x " + std::to_string(job.height) +
                          " pixels in " + std::to_string(bytes.size()) +
                          " bytes, expected a complete PNG");
  texture::Pixels<Value> image{job.width, job.height, job.channels, {}};
  image.values.resize(job.row_bytes / sizeof(Value) * job.height);
  if (!read_rows(job, reinterpret_cast<png_byte*>(image.values.data())))
    fail(job, name);
  return image;
}

} // namespace

texture::Image read_png(std::string_view bytes, const std::string& name) {
  return read<std::uint8_t>(bytes, name);
}

texture::DeepImage read_deep_png(std::string_view bytes, const std::string& name) {
  return read<std::uint16_t>(bytes, name);
}

std::string write_png(const texture::Image& image) {
  std::string bytes;
  Job job;
  job.out = &bytes;
  const Session session(job, false);
  if (!write_all(job, image))
    throw Error(std::string("cannot make a PNG: ") + job.message.data());
  return bytes;
}

} // namespace gewebe::formats
