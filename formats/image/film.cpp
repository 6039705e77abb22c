#include "formats/image/film.h"

#include "base/error.h"
#include "text/number_text.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace gewebe::formats {
namespace {

std::string size_text(const FilmOptions& options) {
  return std::to_string(options.width) + "x" + std::to_string(options.height);
}

/// Options of the stream that ffmpeg reads, and of what most players show.
std::vector<std::string> ffmpeg_words(const FilmOptions& options, const std::string& file) {
  std::vector<std::string> words{"ffmpeg",
                                 "-nostdin",
                                 "-loglevel",
                                 "quiet",
                                 "-f",
                                 "rawvideo",
                                 "-pix_fmt",
                                 "rgb24",
                                 "-s",
                                 size_text(options),
                                 "-r",
                                 gewebe::text::number_text(options.rate),
                                 "-i",
                                 "pipe:0",
                                 "-pix_fmt",
                                 "yuv420p",
                                 "-map_metadata",
                                 "-1",
                                 "-fflags",
                                 "+bitexact",
                                 "-flags:v",
                                 "+bitexact"};
  const std::vector<std::string> mp4{"-c:v", "libx264", "-crf", "18", "-movflags", "+faststart"},
      webm{"-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0"};
  const bool is_mp4 = options.kind == Kind::mp4;
  words.insert(words.end(), (is_mp4 ? mp4 : webm).begin(), (is_mp4 ? mp4 : webm).end());
  for (const std::string& word :
       {std::string("-f"), std::string(is_mp4 ? "mp4" : "webm"), std::string("-y"), "file:" + file})
    words.push_back(word);
  return words;
}

} // namespace

const std::vector<Kind>& film_kinds() {
  static const std::vector<Kind> kinds{Kind::mp4, Kind::webm};
  return kinds;
}

FilmWriter::FilmWriter(Output& output, const FilmOptions& options) : output_(output) {
  if (options.width % 2 != 0 || options.height % 2 != 0)
    throw Error(output.name(), "a film of " + size_text(options) + " pixels, expected even sides");
  std::vector<std::string> words = ffmpeg_words(options, output.temporary());
  std::vector<char*> arguments;
  for (std::string& word : words)
    arguments.push_back(word.data());
  arguments.push_back(nullptr);
  // A socket, since writing to a pipe whose reader ended would be a signal.
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw Error(output.name(), std::string("cannot start ffmpeg: ") + std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  const int failure =
      ::posix_spawnp(&child_, "ffmpeg", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  socket_ = ends[0];
  if (failure == 0)
    return;
  ::close(socket_);
  throw Error(output.name(),
              "cannot start ffmpeg, which codes films: " + std::string(std::strerror(failure)) +
                  "; expected it, or the stream coded elsewhere: --to rgb -o - | ffmpeg -f "
                  "rawvideo -pix_fmt rgb24 -s " +
                  size_text(options) + " -r " + gewebe::text::number_text(options.rate) +
                  " -i - -pix_fmt yuv420p FILM");
}

FilmWriter::~FilmWriter() {
  if (child_ < 0)
    return;
  ::kill(child_, SIGKILL);
  wait_for_end();
}

void FilmWriter::wait_for_end() {
  if (socket_ >= 0)
    ::close(socket_);
  socket_ = -1;
  while (::waitpid(child_, &status_, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
}

void FilmWriter::add(const texture::Image& picture) {
  const auto* bytes = reinterpret_cast<const char*>(picture.values.data());
  for (std::size_t left = picture.values.size(); left > 0;) {
    const ssize_t sent = ::send(socket_, bytes, left, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR)
      continue;
    if (sent <= 0) {
      finish();
      throw Error(output_.name(), "ffmpeg ended before the film did");
    }
    bytes += sent;
    left -= static_cast<std::size_t>(sent);
  }
}

void FilmWriter::finish() {
  if (child_ < 0)
    return;
  wait_for_end();
  if (WIFEXITED(status_) && WEXITSTATUS(status_) == 0)
    return;
  const std::string how = WIFEXITED(status_) ? "status " + std::to_string(WEXITSTATUS(status_))
                                             : "signal " + std::to_string(WTERMSIG(status_));
  throw Error(output_.name(), "ffmpeg failed with " + how +
                                  ", expected one with the encoder libx264 for mp4 or libvpx-vp9 "
                                  "for webm");
}

} // namespace gewebe::formats
