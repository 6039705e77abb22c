#include "formats/image/pnm.h"

#include "base/error.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace gewebe::formats {
namespace {

constexpr std::uint32_t max_side = 32768;

bool is_blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

/// Values are scaled to 0 … the largest that Value holds.
template <class Value>
class Reader {
public:
  Reader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  texture::Pixels<Value> read() {
    const char letter = bytes_.size() > 1 && bytes_[0] == 'P' ? bytes_[1] : '?';
    if (letter != '2' && letter != '3' && letter != '5' && letter != '6')
      fail("no PNM, expected P2, P3, P5 or P6");
    at_ = 2;
    texture::Pixels<Value> image;
    image.channels = letter == '3' || letter == '6' ? 3 : 1;
    image.width = number("width", 1, max_side);
    image.height = number("height", 1, max_side);
    maxval_ = number("maxval", 1, 65535);
    const std::size_t count = std::size_t{image.width} * image.height * image.channels;
    if (letter < '4')
      read_text(image, count);
    else
      read_binary(image, count);
    return image;
  }

private:
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name_ + ":" + std::to_string(line_), what);
  }
  [[noreturn]] void fail_at_byte(const std::string& what) const {
    throw Error(name_, "byte " + std::to_string(at_) + ": " + what);
  }

  void skip_blanks() {
    for (; at_ < bytes_.size(); ++at_) {
      if (bytes_[at_] == '#')
        at_ = std::min(bytes_.find('\n', at_), bytes_.size());
      if (at_ == bytes_.size())
        return;
      if (!is_blank(bytes_[at_]))
        return;
      line_ += bytes_[at_] == '\n' ? 1U : 0U;
    }
  }

  std::uint32_t number(const char* what, std::uint32_t min, std::uint32_t max) {
    skip_blanks();
    if (at_ == bytes_.size())
      fail(std::string("ends before the ") + what + ", expected a complete file");
    std::uint32_t value = 0;
    const char* const end = bytes_.data() + bytes_.size();
    const auto [rest, status] = std::from_chars(bytes_.data() + at_, end, value);
    if (status != std::errc{} || !(rest == end || is_blank(*rest) || *rest == '#') || value < min ||
        value > max)
      fail(std::string("no ") + what + ", expected " + std::to_string(min) + " to " +
           std::to_string(max));
    at_ = static_cast<std::size_t>(rest - bytes_.data());
    return value;
  }

  Value scaled(std::uint32_t value) const {
    constexpr std::uint32_t top = std::numeric_limits<Value>::max();
    return static_cast<Value>(maxval_ == top ? value : (value * top + maxval_ / 2) / maxval_);
  }

  /// The next value where it is plain: digits between blanks. Anything else, errors too, is for
  /// number().
  std::uint32_t value() {
    std::size_t at = at_;
    for (; at < bytes_.size() && is_blank(bytes_[at]); ++at)
      line_ += bytes_[at] == '\n' ? 1U : 0U;
    at_ = at;
    std::uint32_t sum = 0;
    for (; at < bytes_.size() && at < at_ + 6 && bytes_[at] >= '0' && bytes_[at] <= '9'; ++at)
      sum = 10 * sum + static_cast<std::uint32_t>(bytes_[at] - '0');
    if (at == at_ || at == bytes_.size() || !is_blank(bytes_[at]) || sum > maxval_)
      return number("value", 0, maxval_);
    at_ = at;
    return sum;
  }

  void read_text(texture::Pixels<Value>& image, std::size_t count) {
    // Each value takes two bytes, the last perhaps one.
    if (count > (bytes_.size() - at_ + 1) / 2)
      fail("too few bytes for " + std::to_string(count) + " values, expected a complete file");
    image.values.reserve(count);
    for (std::size_t n = 0; n < count; ++n)
      image.values.push_back(scaled(value()));
    skip_blanks();
    if (at_ != bytes_.size())
      fail("goes on after the last value, expected the end");
  }

  void read_binary(texture::Pixels<Value>& image, std::size_t count) {
    ++at_; // the blank behind maxval
    const std::size_t width = maxval_ > 255 ? 2 : 1;
    const std::size_t left = at_ < bytes_.size() ? bytes_.size() - at_ : 0;
    if (left != count * width)
      fail_at_byte(std::to_string(left) + " bytes of values, expected " +
                   std::to_string(count * width));
    image.values.reserve(count);
    for (; at_ < bytes_.size(); at_ += width) {
      std::uint32_t value = static_cast<unsigned char>(bytes_[at_]);
      if (width == 2)
        value = 256 * value + static_cast<unsigned char>(bytes_[at_ + 1]);
      if (value > maxval_)
        fail_at_byte("value " + std::to_string(value) + ", expected at most " +
                     std::to_string(maxval_));
      image.values.push_back(scaled(value));
    }
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0, line_ = 1;
  std::uint32_t maxval_ = 255;
};

} // namespace

texture::Image read_pnm(std::string_view bytes, const std::string& name) {
  return Reader<std::uint8_t>(bytes, name).read();
}

texture::DeepImage read_deep_pnm(std::string_view bytes, const std::string& name) {
  return Reader<std::uint16_t>(bytes, name).read();
}

std::string write_ppm(const texture::Image& image) {
  std::string bytes =
      "P6\n" + std::to_string(image.width) + " " + std::to_string(image.height) + "\n255\n";
  bytes.append(image.values.begin(), image.values.end());
  return bytes;
}

} // namespace gewebe::formats
