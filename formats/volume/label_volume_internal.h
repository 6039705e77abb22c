#pragma once
// What the readers of label volumes share: bytes that come forwards, numbers out of them, voxels.

#include "formats/volume/label_volume.h"
#include "labels/grey_volume.h"

#include <cstddef>
#include <functional>
#include <istream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

/// Bytes that come forwards.
class ByteSource {
public:
  ByteSource() = default;
  virtual ~ByteSource() = default;
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;
  /// Up to `count` bytes; fewer only at the end. \throw Error
  virtual std::size_t read(char* to, std::size_t count) = 0;
};

class MemoryBytes final : public ByteSource {
public:
  explicit MemoryBytes(std::string_view bytes) : rest_(bytes) {}
  std::size_t read(char* to, std::size_t count) override;

private:
  std::string_view rest_;
};

class StreamBytes final : public ByteSource {
public:
  StreamBytes(std::istream& stream, std::string name) : stream_(stream), name_(std::move(name)) {}
  std::size_t read(char* to, std::size_t count) override;

private:
  std::istream& stream_;
  std::string name_;
};

/// Looks ahead and cuts lines.
class BufferedBytes final : public ByteSource {
public:
  BufferedBytes(ByteSource& from, std::string name) : from_(from), name_(std::move(name)) {}
  const std::string& name() const { return name_; }
  std::size_t read(char* to, std::size_t count) override;
  /// The next bytes, fewer than `count` only at the end. \pre count <= 4096
  std::string_view peek(std::size_t count);
  /// The next line without its end, or nothing at the end of all. \throw Error if it is longer than
  /// 65536 bytes
  std::optional<std::string> line();
  /// \throw Error if there are fewer
  void skip(std::uint64_t count);

private:
  bool fill();
  ByteSource& from_;
  std::string name_, buffer_;
  std::size_t next_ = 0;
};

/// gzip (all members) or zlib, each to its checksum. \throw Error (place = name) if the data is
/// damaged, cut off or followed by something else
class InflatedBytes final : public ByteSource {
public:
  InflatedBytes(BufferedBytes& from, std::string name);
  ~InflatedBytes() override;
  std::size_t read(char* to, std::size_t count) override;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Does this begin like gzip?
inline bool is_gzip(std::string_view bytes) {
  return bytes.starts_with("\x1f\x8b");
}

/// Types of voxels, and how the bytes mean numbers.
enum class ScalarType { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };
std::size_t bytes_of(ScalarType type);

struct VoxelLayout {
  Int3 size{};
  volume::GridTransform transform; ///< RAS, mm
  ScalarType type = ScalarType::u8;
  bool big_endian = false;
  double slope = 1, intercept = 0; ///< label = slope · stored + intercept
};

/// Request to a reader.
struct LabelRequest {
  const std::vector<LabelRange>& labels;
  const Context& context;
  const LabelCheck& check;
  bool side_files; ///< whether the name is that of a file, beside which others may be opened
  // One of these may receive the result in place of the mask's bits.
  labels::LabelRuns* all;
  labels::GreyVolume* grey;
  VoxelLayout* layout = nullptr; ///< then no voxel is read
};

/// The request with its number in place of its name, if it has one. \throw Error, place = file, if
/// no label or two have this name
LabelRange numbered_label(const LabelRange& request,
                          const std::vector<std::pair<std::int64_t, std::string>>& names,
                          const std::string& file);

/// Reads a volume of any of the formats for a request.
LabelVolume read_radiology(ByteSource& source, const std::string& name,
                           const LabelRequest& request);

/// Reads the voxels to the end of `data`, which is called `name`. Fills all but format and
/// warnings.
LabelVolume read_voxels(ByteSource& data, const std::string& name, const VoxelLayout& layout,
                        const LabelRequest& request);

/// Sizes as a header claims them. \throw Error unless each is 1 … 2^20
Int3 checked_size(const std::string& place, const std::array<std::int64_t, 3>& size);
/// \throw Error unless finite and far enough from singular
void check_affine(const std::string& place, const volume::GridTransform& transform);

/// Words of a header's value, split at blanks.
std::vector<std::string_view> words_of(std::string_view text);
std::string_view trimmed(std::string_view text);
/// "'text'", shortened.
std::string quoted(std::string_view text);
/// \throw Error (place) unless the whole word is a finite number, a whole number
double number_of(const std::string& place, std::string_view word);
std::int64_t whole_of(const std::string& place, std::string_view word);

struct HeaderField {
  std::string value, place;
};

/// The fields of a header of text by name.
class HeaderFields {
public:
  const HeaderField* find(const std::string& key) const;
  /// \throw Error if absent
  const HeaderField& need(const std::string& key) const;

protected:
  /// `header` says what it is, \pre `file` outlives this
  HeaderFields(const std::string& file, std::string header)
      : name_(file), header_(std::move(header)) {}
  const std::string& name_;
  std::map<std::string, HeaderField> fields_;

private:
  std::string header_;
};

/// Refuses a pipe or a device as the file beside a header: it might never end, or never begin.
/// \throw Error
void require_no_pipe(const std::string& path);

/// Reads voxels from the file that a header's field names, in the header's folder. \throw Error if
/// it names several, or the request has no side files
LabelVolume read_side_file(const std::string& header, const HeaderField& file,
                           const LabelRequest& request,
                           const std::function<LabelVolume(BufferedBytes&)>& read);

LabelVolume read_nifti(BufferedBytes& bytes, const LabelRequest& request);
LabelVolume read_nrrd(BufferedBytes& bytes, const LabelRequest& request);
LabelVolume read_meta_image(BufferedBytes& bytes, const LabelRequest& request);
LabelVolume read_inr(BufferedBytes& bytes, const LabelRequest& request);

/// By the first bytes, uncompressed.
bool is_nifti(std::string_view bytes);
bool is_nrrd(std::string_view bytes);
bool is_meta_image(std::string_view bytes);
bool is_inr(std::string_view bytes);

} // namespace gewebe::formats
