#pragma once
// Files and pipes as every program treats them: `-` is the pipe, input is read once and forwards,
// output appears whole or not at all.

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace gewebe::formats {

/// Bytes that were read, in pages of their own, which live as long as a copy of this.
class InputBytes {
public:
  std::string_view view() const { return bytes_; }

private:
  friend class Input;
  std::shared_ptr<const void> pages_;
  std::string_view bytes_;
};

/// A file, FIFO or standard input ("-" or ""), opened for reading forwards.
class Input {
public:
  /// `binary` says that a person can't type it.
  /// \throw Error (place = name) if it is missing, unreadable or a directory; UsageError if binary
  /// input would come from a terminal
  explicit Input(const std::string& path, bool binary = true);
  ~Input();
  Input(Input&&) noexcept;

  /// How messages name it: the path, or "-".
  const std::string& name() const;
  /// The first bytes (at most `count`, fewer at the end) without consuming them.
  /// \pre count <= 4096, nothing was read yet   \throw Error on a read error or if there are none
  /// at all
  std::string_view peek(std::size_t count);
  /// Everything that is left.
  /// \throw Error on a read error, if there is nothing at all, or when more than `max_bytes` come
  std::string read_all(std::uint64_t max_bytes = UINT64_MAX);
  /// The same for what may be large: no byte is copied as they become more, which takes half the
  /// time where they come from a pipe and it isn't known how many there are.
  InputBytes read_all_pages(std::uint64_t max_bytes = UINT64_MAX);
  /// A std::istream over what is left; a read error sets badbit.
  std::istream& stream();
  /// Waits without sleep for bytes of a pipe or terminal, or its end: a processor that stays awake
  /// has the first of them sooner.
  void wait_awake() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Where bytes go: standard output ("-" or "") or a file.
///
/// If the file is absent or regular, bytes go to a temporary file beside it (beside the target of a
/// symlink), with the old mode or 0666 & ~umask, and `commit` renames it. Anything else (/dev/null,
/// a FIFO) is opened at the first write and written directly. Without `commit` the destructor
/// removes the temporary file; so do SIGINT, SIGTERM, SIGHUP and SIGPIPE once
/// `install_signal_cleanup` was called.
class Output {
public:
  struct Options {
    bool keep_unchanged =
        false;          ///< leave the file and its time stamp alone if the bytes would be equal
    bool sync = false;  ///< fsync before the rename
    bool part = false;  ///< the temporary file is FILE.part, may be kept, and is taken up again
    bool binary = true; ///< refuse a terminal
    /// A file that is written beside the result (a log, a record, statistics, a companion): a FIFO
    /// or a device is refused, since one without a reader would hold up the result.
    bool beside = false;
    /// If not empty, the temporary file is FILE.part, too; one that an earlier run left, which
    /// begins with these bytes, is overwritten.
    std::string log{};
  };
  /// \throw Error (place = name) if the folder is not writable or the path is a directory;
  /// UsageError if binary output would go to a terminal
  Output(const std::string& path, const Options& options);
  ~Output();
  Output(Output&&) noexcept;

  const std::string& name() const;
  /// \throw Error "No space left on device" and the like
  void write(const void* data, std::size_t size);
  void write(std::string_view bytes) { write(bytes.data(), bytes.size()); }
  /// A std::ostream that ends in `write`; errors of `write` are thrown from it.
  std::ostream& stream();
  /// For libraries that write by name and not forwards (HDF5): the temporary file, empty at first;
  /// close the library's file before `commit`, and `write` nothing yourself.
  /// \throw Error if this is standard output or no regular file
  const std::string& temporary() const;
  /// With Options::part: whatever ends the program now, the temporary file stays; and whether it is
  /// one that stays.
  void keep_part(bool keep = true);
  bool part() const;
  /// From now on a signal or a crash leaves the temporary file, which is locked (flock) as long as
  /// the program runs; the destructor removes it as before.
  void outlive_signals();
  /// Writes bytes that are in the temporary file whole or not at all, whatever ends the program;
  /// until then the byte at their beginning is 0. To a pipe or a device as `write`.
  /// \pre the bytes hold no 0
  /// \throw Error; what stands before them is kept
  void append_whole(std::string_view bytes);
  /// Blocks of the disk for a file of so many bytes. \throw Error if it has none left
  void reserve(std::uint64_t bytes);
  /// Drops all that was written to the temporary file. \pre there is one
  void start_over();
  /// Flushes, checks, closes, renames. \throw Error
  void commit();
  /// All of it but the rename, for files that belong together: `commit` then has no more to write.
  /// \throw Error
  void prepare();
  /// `commit` under the name partial_name(target), since the result isn't all there.
  /// \return that name. \pre there is a temporary file \throw Error
  std::string commit_partial();
  /// Whether a temporary file takes the bytes, so that `commit_partial` can keep them.
  bool has_temporary() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Installs the handlers that remove temporary files when a signal ends the program. For tools
/// only.
void install_signal_cleanup();

} // namespace gewebe::formats
