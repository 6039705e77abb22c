#include "formats/mesh/particles_file.h"

#include "base/error.h"
#include "text/number_text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

namespace gewebe::formats {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

std::string_view next_word(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin]))
    ++begin;
  std::size_t end = begin;
  while (end < line.size() && !is_blank(line[end]))
    ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

std::string quote(std::string_view word) {
  return "'" + std::string(word.substr(0, 40)) + (word.size() > 40 ? "…'" : "'");
}

/// Where a line stands; the text of a place is made only for an error.
struct Line {
  const std::string& name;
  std::size_t number;
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(name + ":" + std::to_string(number), what);
  }
};

double parse(std::string_view word, const Line& where) {
  double value = 0;
  const std::string_view digits = gewebe::text::without_plus(word);
  const auto [rest, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (status != std::errc{} || rest != digits.data() + digits.size())
    where.fail(quote(word) + " is no number, expected x y z R [weight]");
  if (!std::isfinite(value))
    where.fail(quote(word) + " is not finite");
  return value;
}

std::optional<Particle> parse_line(std::string_view line, const Line& where, double unit) {
  std::array<double, 5> numbers{0, 0, 0, 0, 1};
  std::size_t count = 0;
  for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
    if (count == numbers.size())
      where.fail("more than five numbers, expected x y z R [weight]");
    numbers.at(count++) = parse(word, where);
  }
  if (count == 0)
    return std::nullopt;
  if (count < 4)
    where.fail(std::to_string(count) + (count == 1 ? " number" : " numbers") +
               ", expected x y z R [weight]");
  const Particle particle{
      {numbers[0] * unit, numbers[1] * unit, numbers[2] * unit}, numbers[3] * unit, numbers[4]};
  if (!(particle.support_radius > 0))
    where.fail("R is not positive");
  if (!is_finite(particle.center) || !std::isfinite(particle.support_radius))
    where.fail("too large a coordinate");
  return particle;
}

} // namespace

Particles read_particles(std::string_view text, const std::string& name, double unit) {
  Particles particles;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line = line.substr(0, line.find('#'));
    if (line.empty())
      continue;
    if (const auto particle = parse_line(line, {name, line_number}, unit))
      particles.push_back(*particle);
  }
  if (particles.empty())
    throw Error(name, "no particle, expected lines of x y z R [weight]");
  return particles;
}

std::string write_particles(const Particles& particles) {
  std::string text;
  const auto add = [&text](double value, char after) {
    std::array<char, 32> word{};
    const auto result = std::to_chars(word.data(), word.data() + word.size(), value);
    text.append(word.data(), result.ptr);
    text += after;
  };
  for (const Particle& particle : particles) {
    add(particle.center.x, ' ');
    add(particle.center.y, ' ');
    add(particle.center.z, ' ');
    add(particle.support_radius, particle.weight == 1 ? '\n' : ' ');
    if (particle.weight != 1)
      add(particle.weight, '\n');
  }
  return text;
}

double unit_in_mm(std::string_view unit) {
  if (unit == "mm")
    return 1;
  if (unit == "cm")
    return 10;
  if (unit == "m")
    return 1000;
  throw UsageError("--unit: '" + std::string(unit) + "', expected m, cm or mm");
}

} // namespace gewebe::formats
