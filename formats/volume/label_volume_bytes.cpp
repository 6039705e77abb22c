#include "formats/volume/label_volume_internal.h"

#include "base/error.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace gewebe::formats {

std::size_t MemoryBytes::read(char* to, std::size_t count) {
  const std::size_t n = std::min(count, rest_.size());
  std::copy_n(rest_.data(), n, to);
  rest_.remove_prefix(n);
  return n;
}

std::size_t StreamBytes::read(char* to, std::size_t count) {
  stream_.read(to, static_cast<std::streamsize>(count));
  if (stream_.bad())
    throw Error(name_, "cannot read");
  return static_cast<std::size_t>(stream_.gcount());
}

// ---- BufferedBytes

bool BufferedBytes::fill() {
  constexpr std::size_t block = 65536;
  buffer_.erase(0, next_);
  next_ = 0;
  const std::size_t old = buffer_.size();
  buffer_.resize(old + block);
  const std::size_t got = from_.read(buffer_.data() + old, block);
  buffer_.resize(old + got);
  return got > 0;
}

std::size_t BufferedBytes::read(char* to, std::size_t count) {
  const std::size_t ready = std::min(count, buffer_.size() - next_);
  std::copy_n(buffer_.data() + next_, ready, to);
  next_ += ready;
  return ready == count ? count : ready + from_.read(to + ready, count - ready);
}

std::string_view BufferedBytes::peek(std::size_t count) {
  while (buffer_.size() - next_ < count && fill()) {
  }
  return std::string_view(buffer_).substr(next_, count);
}

std::optional<std::string> BufferedBytes::line() {
  constexpr std::size_t longest = 65536;
  std::size_t searched = 0;
  for (;;) {
    const std::string_view rest = std::string_view(buffer_).substr(next_);
    const std::size_t end = rest.find('\n', searched);
    if (end != std::string_view::npos) {
      std::string text(rest.substr(0, end));
      next_ += end + 1;
      if (text.ends_with('\r'))
        text.pop_back();
      return text;
    }
    searched = rest.size();
    if (searched > longest)
      throw Error(name_, "a line of the header is longer than 65536 bytes");
    if (!fill()) {
      if (searched == 0)
        return std::nullopt;
      std::string text = buffer_.substr(next_);
      next_ = buffer_.size();
      return text;
    }
  }
}

void BufferedBytes::skip(std::uint64_t count) {
  std::array<char, 4096> block{};
  while (count > 0) {
    const std::size_t part = static_cast<std::size_t>(std::min<std::uint64_t>(count, block.size()));
    if (read(block.data(), part) < part)
      throw Error(name_, "ends before its voxels begin");
    count -= part;
  }
}

// ---- InflatedBytes

struct InflatedBytes::State {
  State(BufferedBytes& bytes, std::string n) : from(bytes), name(std::move(n)) {
    if (inflateInit2(&stream, 15 + 32) != Z_OK) // zlib or gzip, detected by their heads
      throw Error(name, "zlib cannot start");
  }
  ~State() { (void)inflateEnd(&stream); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  BufferedBytes& from;
  std::string name;
  z_stream stream{};
  std::array<char, 65536> input{};
  bool gzip = false, begun = false, ended = false;

  void refill() {
    if (stream.avail_in > 0)
      return;
    const std::size_t got = from.read(input.data(), input.size());
    stream.next_in = reinterpret_cast<Bytef*>(input.data());
    stream.avail_in = static_cast<uInt>(got);
  }
};

InflatedBytes::InflatedBytes(BufferedBytes& from, std::string name)
    : state_(std::make_unique<State>(from, std::move(name))) {}
InflatedBytes::~InflatedBytes() = default;

std::size_t InflatedBytes::read(char* to, std::size_t count) {
  State& s = *state_;
  std::size_t done = 0;
  if (!s.begun) {
    s.gzip = is_gzip(s.from.peek(2));
    s.begun = true;
  }
  while (done < count && !s.ended) {
    s.refill();
    if (s.stream.avail_in == 0)
      throw Error(s.name, "ends within its compressed data");
    const std::size_t part = std::min<std::size_t>(count - done, 1U << 30U);
    s.stream.next_out = reinterpret_cast<Bytef*>(to + done);
    s.stream.avail_out = static_cast<uInt>(part);
    const int result = inflate(&s.stream, Z_NO_FLUSH);
    done += part - s.stream.avail_out;
    if (result == Z_STREAM_END) {
      s.refill();
      if (s.stream.avail_in == 0) {
        s.ended = true;
      } else {
        // gzip files may be joined (RFC 1952, 2.2); inflateReset keeps next_in.
        if (!s.gzip || *s.stream.next_in != 0x1f)
          throw Error(s.name, "goes on after its compressed data, expected its end");
        (void)inflateReset(&s.stream);
      }
    } else if (result != Z_OK && result != Z_BUF_ERROR) {
      throw Error(s.name, std::string("the compressed data is damaged") +
                              (s.stream.msg != nullptr ? std::string(": ") + s.stream.msg : ""));
    }
  }
  return done;
}

} // namespace gewebe::formats
