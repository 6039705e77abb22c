#pragma once
// What a driven scene owes to who drives it, line by line: one acknowledgement or error for each,
// of its number, last of all; answers without numbers that are none; and shared shapes that are
// those of the answers, to the last bit.

#include "formats/results/shared_shapes.h"
#include "text/number_text.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::test {

/// Stands in a scene for another client, whose lines are counted from 1: a comment to the scene.
inline constexpr const char* next_client = "# the next client";

/// What the file of shared shapes holds; nobody writes it meanwhile.
struct SharedContent {
  formats::SharedFrame head;
  std::map<std::string, std::vector<double>> positions;
  std::string fault;
};
inline SharedContent shared_content(const std::string& path) {
  SharedContent out;
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  formats::SharedHead head;
  const auto load = [&](auto& value, std::size_t offset) {
    const bool there = offset <= bytes.size() && sizeof value <= bytes.size() - offset;
    if (there)
      std::memcpy(&value, bytes.data() + offset, sizeof value);
    else
      out.fault = "the file of shapes ends at " + std::to_string(bytes.size());
    return there;
  };
  if (!load(head, 0) || head.sequence == 0)
    return out;
  const formats::SharedPlace place = head.sequence % 2 == 1 ? head.odd : head.even;
  if (!load(out.head, place.offset))
    return out;
  if (out.head.sequence != head.sequence || head.begun != head.sequence ||
      out.head.bytes > place.bytes || place.offset + place.bytes > bytes.size())
    out.fault = "frame " + std::to_string(head.sequence) + " of shapes is not in its place";
  for (std::size_t k = 0; out.fault.empty() && k < out.head.objects; ++k) {
    formats::SharedObject object;
    if (!load(object, place.offset + sizeof out.head + k * sizeof object))
      return out;
    if (object.positions + 24 * object.nodes > out.head.bytes ||
        object.name + object.name_bytes > out.head.bytes) {
      out.fault = "an object of shapes leaves its frame";
      return out;
    }
    std::vector<double>& all =
        out.positions[bytes.substr(place.offset + object.name, object.name_bytes)];
    all.resize(3 * object.nodes);
    if (!all.empty())
      std::memcpy(all.data(), bytes.data() + place.offset + object.positions, 8 * all.size());
  }
  return out;
}

/// Looks at each reply as it comes.
class DoorCheck {
public:
  /// \param shapes path of the shared shapes; none: ""
  explicit DoorCheck(std::string shapes) : shapes_(std::move(shapes)) {}

  void line(std::string_view text) {
    if (text == next_client)
      number_ = 0;
    ++number_;
    ended_ = 0;
  }
  void line_done() {
    if (ended_ != 1 && fault.empty())
      fault = "line " + std::to_string(number_) + " of its client is acknowledged " +
              std::to_string(ended_) + " times";
  }
  void reply(std::string_view text) {
    const std::string number = std::to_string(number_);
    if (ended_ > 0)
      fault = "it speaks behind the end of line " + number + ": " + std::string(text);
    if (text == "ok " + number + "\n" || text.starts_with("error " + number + ": "))
      ++ended_;
    else if (text.starts_with("step "))
      step(text);
    else if (text.starts_with("sync "))
      answers += text;
    else if (!text.starts_with("nodes ") && !text.starts_with("select ") &&
             !text.starts_with("objects ") && !text.starts_with("instruments "))
      fault = "it says: " + std::string(text.substr(0, 80));
    if (text.empty() || text.back() != '\n')
      fault = "a reply without an end";
  }

  std::string fault;
  std::string answers; ///< to what a record keeps: steps and sync

private:
  void step(std::string_view text) {
    answers += text;
    ++steps_;
    if (shapes_.empty())
      return;
    const SharedContent shared = shared_content(shapes_);
    if (!shared.fault.empty())
      fault = shared.fault;
    if (shared.head.sequence != steps_ || shared.head.step != steps_ ||
        shared.head.generation < generation_)
      fault = "shapes of step " + std::to_string(shared.head.step) + " behind step " +
              std::to_string(steps_);
    generation_ = shared.head.generation;
    std::istringstream lines{std::string(text)};
    for (std::string word, row; std::getline(lines, row);) {
      std::istringstream words(row);
      std::string name;
      std::size_t count = 0;
      if (!(words >> word >> name >> count) || word != "shapes")
        continue;
      const auto found = shared.positions.find(name);
      if (found == shared.positions.end() || found->second.size() < 3 * count) {
        fault = "no shape of " + name + " is shared, or not all of it";
        return;
      }
      for (std::size_t k = 0; k < count && std::getline(lines, row); ++k) {
        const std::vector<double>& all = found->second;
        const std::string place = text::number_text(all[3 * k]) + " " +
                                  text::number_text(all[3 * k + 1]) + " " +
                                  text::number_text(all[3 * k + 2]);
        if (row != place)
          fault = "node " + std::to_string(k) + " of " + name + " is shared at " + place +
                  " and answered at " + row;
      }
    }
  }

  std::string shapes_;
  std::uint64_t number_ = 0, steps_ = 0, generation_ = 0;
  std::size_t ended_ = 0;
};

} // namespace gewebe::test
