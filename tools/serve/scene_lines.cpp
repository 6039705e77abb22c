#include "tools/serve/scene_lines.h"

#include "base/error.h"
#include "tools/run/step_latency.h"

#include <istream>
#include <streambuf>

namespace gewebe::cli {

namespace {

constexpr std::uint64_t longest_line = 1U << 24U; // that is carried out
constexpr std::uint64_t longest_rest = 1U << 30U; // of one that is not, to be passed over

} // namespace

bool SceneLines::take(char c) {
  if (c != '\n') {
    if (++size_ <= longest_line)
      line_ += c;
    else if (size_ == longest_line + 1)
      run_.overlong_line(); // now: there may be no end to it
    else if (size_ > longest_rest)
      return false;
    return true;
  }
  if (size_ <= longest_line)
    run_.line(line_);
  drop();
  return true;
}

void SceneLines::end() {
  if (size_ <= longest_line && !line_.empty())
    run_.line(line_);
  drop();
}

void SceneLines::drop() {
  line_.clear();
  size_ = 0;
}

void run_lines(formats::Input& input, SceneRun& run, bool awake) {
  // The stream's buffer hands out what has come so far and waits only for more.
  std::streambuf& bytes = *input.stream().rdbuf();
  SceneLines lines(run);
  while (!run.ended()) {
    const bool waits = bytes.in_avail() <= 0;
    if (waits && awake)
      input.wait_awake();
    const auto c = bytes.sbumpc();
    if (waits && run.latency() != nullptr)
      run.latency()->line_arrived();
    if (c == std::streambuf::traits_type::eof())
      break;
    if (!lines.take(static_cast<char>(c)))
      throw Error(input.name(), "a line of over 1 GiB, expected an end");
  }
  lines.end();
}

void run_scene(formats::Input& input, SceneRun& run) {
  run_lines(input, run);
  run.finish();
}

} // namespace gewebe::cli
