#include "base/crc32c.h"
#include "base/digest.h"
#include "base/error.h"
#include "formats/store/column_journal_internal.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <sstream>
#include <unistd.h>
#include <utility>

namespace gewebe::formats {

namespace {

constexpr const char* first_line = "part 1";

std::string crc_text(std::uint32_t crc) {
  std::array<char, 16> text{};
  (void)std::snprintf(text.data(), text.size(), "%08x", crc);
  return text.data();
}

std::string signed_line(const std::string& text) {
  return text + " " + crc_text(crc32c(text.data(), text.size())) + "\n";
}

/// The text of a whole line, or nothing.
std::optional<std::string> text_of(const std::string& line) {
  const std::size_t end = line.find_last_of(' ');
  if (end == std::string::npos || line.substr(end + 1) != crc_text(crc32c(line.data(), end)))
    return std::nullopt;
  return line.substr(0, end);
}

} // namespace

ColumnJournal::ColumnJournal(const std::string& part, std::uint64_t part_bytes)
    : part_(part), path_(part + ".log") {
  read();
  // It is made before the first byte of the part: what has none is not ours.
  if (part_bytes > 0 && fd_ < 0)
    throw Error(part_, "is there without " + path_ +
                           ", so it is no unfinished store; expected it moved away or removed");
  if (part_bytes > 0 || fd_ < 0)
    return;
  known_.clear();
  (void)::close(std::exchange(fd_, -1));
  (void)::unlink(path_.c_str());
}

ColumnJournal::~ColumnJournal() {
  if (fd_ >= 0)
    (void)::close(fd_);
}

void ColumnJournal::read() {
  fd_ = ::open(path_.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0 && errno == ENOENT)
    return;
  if (fd_ < 0)
    throw Error(path_, std::string("cannot read: ") + std::strerror(errno));
  const auto not_ours = [&] {
    return Error(path_, "is no journal of an unfinished store, expected '" +
                            std::string(first_line) + "' in its first line");
  };
  std::string text;
  std::array<char, 65536> block{};
  for (ssize_t count = 0; (count = ::read(fd_, block.data(), block.size())) != 0;) {
    if (count < 0 && errno == EINTR)
      continue;
    if (count < 0)
      throw Error(path_, std::string("cannot read: ") + std::strerror(errno));
    text.append(block.data(), static_cast<std::size_t>(count));
  }
  const std::size_t whole = text.find_last_of('\n') + 1; // 0 where there is none
  if (whole == 0 && !signed_line(first_line).starts_with(text))
    throw not_ours();
  std::istringstream lines(text.substr(0, whole));
  std::string line;
  if (std::getline(lines, line)) {
    const std::optional<std::string> head = text_of(line);
    if (head != first_line)
      throw head && head->starts_with("part ")
          ? Error(path_, "is of version " + head->substr(5) + ", expected 1")
          : not_ours();
  }
  while (std::getline(lines, line))
    read_line(line);
  // A line cut short is forgotten.
  if (::ftruncate(fd_, static_cast<off_t>(whole)) != 0 ||
      ::lseek(fd_, static_cast<off_t>(whole), SEEK_SET) < 0)
    throw Error(path_, std::string("cannot write: ") + std::strerror(errno));
  if (whole == 0)
    write(signed_line(first_line));
}

void ColumnJournal::read_line(const std::string& line) {
  const std::optional<std::string> text = text_of(line);
  if (!text)
    return; // what it said is computed again
  std::istringstream words(*text);
  std::string kind, residual;
  std::size_t index = 0, k = 0;
  Known known;
  ColumnRecord record;
  words >> kind >> index;
  if (kind == "object" && words >> std::hex >> known.object.hash >> known.object.work &&
      index == known_.size()) {
    (void)words.get();
    (void)std::getline(words, known.object.name);
    known_.push_back(std::move(known));
  } else if (kind == "columns" && words >> k >> std::hex >> record.crc >> residual &&
             index < known_.size()) {
    record.residual = std::strtod(residual.c_str(), nullptr);
    known_[index].columns.emplace_back(k, record);
  } else {
    throw Error(path_, "is damaged: '" + *text +
                           "', expected an object or columns; remove it and " + part_ +
                           " to start again");
  }
}

std::vector<std::optional<ColumnRecord>> ColumnJournal::begin(const Object& object,
                                                              std::size_t count) {
  const std::size_t index = object_++;
  std::vector<std::optional<ColumnRecord>> finished(count);
  if (index >= known_.size()) {
    const std::string line =
        signed_line("object " + std::to_string(index) + " " + digest_text(object.hash) + " " +
                    digest_text(object.work) + " " + object.name);
    if (fd_ >= 0)
      write(line);
    else
      ahead_.push_back(line);
    return finished;
  }
  const Known& known = known_[index];
  const std::string remedy = "; remove it to start again";
  if (known.object.hash != object.hash)
    throw Error(part_, "is unfinished work on another model: '" + known.object.name + "' (hash " +
                           digest_text(known.object.hash) + "), expected '" + object.name +
                           "' (hash " + digest_text(object.hash) + ")" + remedy);
  if (known.object.work != object.work || known.object.name != object.name)
    throw Error(part_, "was begun with other options for '" + known.object.name +
                           "', expected the same columns, precision and method" + remedy);
  for (const auto& [k, record] : known.columns)
    if (k < count)
      finished[k] = record;
  return finished;
}

void ColumnJournal::make() {
  if (fd_ >= 0)
    return;
  fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd_ < 0)
    throw Error(path_, std::string("cannot be made: ") + std::strerror(errno));
  write(signed_line(first_line));
  for (const std::string& line : ahead_)
    write(line);
  ahead_.clear();
}

void ColumnJournal::add(std::size_t k, const ColumnRecord& record) {
  make();
  std::array<char, 40> residual{};
  (void)std::snprintf(residual.data(), residual.size(), "%a", record.residual);
  write(signed_line("columns " + std::to_string(object_ - 1) + " " + std::to_string(k) + " " +
                    crc_text(record.crc) + " " + residual.data()));
}

void ColumnJournal::write(const std::string& text) {
  // One call a line: what is cut short is the last line alone.
  ssize_t count = 0;
  do {
    count = ::write(fd_, text.data(), text.size());
  } while (count < 0 && errno == EINTR);
  if (count != static_cast<ssize_t>(text.size()))
    throw Error(path_, std::string("cannot write: ") + std::strerror(count < 0 ? errno : ENOSPC));
}

void ColumnJournal::remove() {
  (void)::unlink(path_.c_str());
}

} // namespace gewebe::formats
