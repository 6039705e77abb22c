#pragma once
// What of a store's columns is finished, beside the store while it is being made: FILE.part.log.
//
// Lines of text, each ended by the CRC-32C of what stands before it, so that a line that a kill cut
// short counts as none:
//
//   part 1
//   object INDEX HASH WORK NAME          the model's hash, and a digest of all that columns depend
//   on columns INDEX K CRC RESIDUAL         of the object's k-th node; the last one holds
//
// A line is written after the bytes it speaks of. It proves nothing by itself: the
// reader of columns compares their checksum. The file is made before the first byte of the store,
// so that a FILE.part without it belongs to another program.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gewebe::formats {

struct ColumnRecord {
  std::uint32_t crc = 0;
  double residual = 0; ///< of the check of its block
};

class ColumnJournal {
public:
  /// What columns belong to.
  struct Object {
    std::uint64_t hash = 0, work = 0;
    std::string name;
  };

  /// Of the file `part`, whose journal is `part`.log. Takes up the lines that are there if the file
  /// holds anything; else forgets them. Makes no file yet. `part_bytes` is the size of `part`.
  /// \throw Error, place = path of the journal, if it is of a newer version, damaged or none of
  /// ours; place = `part` if that holds something and has no journal
  ColumnJournal(const std::string& part, std::uint64_t part_bytes);
  ~ColumnJournal();
  ColumnJournal(const ColumnJournal&) = delete;
  ColumnJournal& operator=(const ColumnJournal&) = delete;

  /// Begins the next object and returns what is finished of its `count` nodes.
  /// \throw Error, place = `part`, if what stands there is of another model or other work
  std::vector<std::optional<ColumnRecord>> begin(const Object& object, std::size_t count);
  void add(std::size_t k, const ColumnRecord& record);
  /// Makes the file if it isn't there. \throw Error, place = path of the journal
  void make();
  /// Removes the file.
  void remove();

private:
  struct Known {
    Object object;
    std::vector<std::pair<std::size_t, ColumnRecord>> columns;
  };
  void read();
  void read_line(const std::string& line);
  void write(const std::string& text);

  std::string part_, path_;
  int fd_ = -1;
  std::vector<Known> known_;       ///< from before
  std::vector<std::string> ahead_; ///< lines that wait for the first column
  std::size_t object_ = 0;         ///< the next one
};

} // namespace gewebe::formats
