#include "formats/volume/label_volume.h"

#include "base/error.h"
#include "formats/stream/file_names.h"
#include "formats/volume/label_volume_internal.h"
#include "text/nearest_word.h"
#include "text/number_text.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <span>
#include <system_error>
#include <unordered_map>
#include <utility>

namespace gewebe::formats {
namespace {

constexpr std::int32_t largest_size = 1 << 20;

std::string size_text(const Int3& size) {
  return std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " +
         std::to_string(size[2]);
}

template <class T>
T swapped(T value) {
  std::array<char, sizeof(T)> bytes{};
  std::memcpy(bytes.data(), &value, sizeof(T));
  std::reverse(bytes.begin(), bytes.end());
  std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

/// Counts labels and looks up the requested ones: small ones from a table, others by hashing.
class Counter {
public:
  explicit Counter(const std::vector<LabelRange>& labels) : labels_(labels) {
    for (const LabelRange& range : labels)
      for (std::int64_t label = std::max(range.first, std::int64_t{0});
           label <= std::min(range.last, table_size - 1); ++label)
        wanted_[static_cast<std::size_t>(label)] = 1;
  }

  bool count(std::int64_t label) {
    if (label >= 0 && label < table_size) {
      ++counts_[static_cast<std::size_t>(label)];
      return wanted_[static_cast<std::size_t>(label)] != 0;
    }
    std::uint64_t& number = others_[label];
    if (++number == 1 && others_.size() > 100000)
      throw Error("more than 100000 different values, expected labels");
    return std::any_of(labels_.begin(), labels_.end(), [&](const LabelRange& range) {
      return label >= range.first && label <= range.last;
    });
  }

  std::vector<std::pair<std::int64_t, std::uint64_t>> result() const {
    std::vector<std::pair<std::int64_t, std::uint64_t>> all(others_.begin(), others_.end());
    for (std::int64_t label = 0; label < table_size; ++label)
      if (const std::uint64_t n = counts_[static_cast<std::size_t>(label)]; n > 0)
        all.emplace_back(label, n);
    std::sort(all.begin(), all.end());
    return all;
  }

private:
  static constexpr std::int64_t table_size = 65536;
  const std::vector<LabelRange>& labels_;
  std::vector<char> wanted_ = std::vector<char>(table_size);
  std::vector<std::uint64_t> counts_ = std::vector<std::uint64_t>(table_size);
  std::unordered_map<std::int64_t, std::uint64_t> others_;
};

/// The label that a stored number means; nothing if it is no whole number.
template <class T>
std::optional<std::int64_t> label_of(T stored, const VoxelLayout& layout) {
  if constexpr (std::is_integral_v<T>)
    if (layout.slope == 1 && layout.intercept == 0 && std::in_range<std::int64_t>(stored))
      return static_cast<std::int64_t>(stored);
  const double value = layout.slope * static_cast<double>(stored) + layout.intercept;
  if (!(std::fabs(value) < 0x1p53) || value != std::trunc(value))
    return std::nullopt;
  return static_cast<std::int64_t>(value);
}

template <class T>
std::string value_text(T stored, const VoxelLayout& layout) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.9g",
                      layout.slope * static_cast<double>(stored) + layout.intercept);
  return text.data();
}

/// Rows of voxels of type T as they are stored; take(row, j, k).
template <class T, class Take>
void read_rows(ByteSource& data, const std::string& name, const VoxelLayout& layout,
               const Context& context, const Take& take) {
  const std::size_t length = static_cast<std::size_t>(layout.size[0]);
  const std::size_t rows =
      static_cast<std::size_t>(layout.size[1]) * static_cast<std::size_t>(layout.size[2]);
  const bool swap = layout.big_endian != (std::endian::native == std::endian::big);
  std::vector<T> row(length);
  for (std::size_t r = 0; r < rows; ++r) {
    if (r % 1024 == 0 && context.cancelled && context.cancelled())
      throw Cancelled();
    const std::size_t got = data.read(reinterpret_cast<char*>(row.data()), length * sizeof(T));
    if (got < length * sizeof(T))
      throw Error(name, "ends after " + std::to_string(r * length * sizeof(T) + got) + " of " +
                            std::to_string(rows * length * sizeof(T)) + " bytes of voxels (" +
                            size_text(layout.size) + ")");
    if (swap)
      for (T& stored : row)
        stored = swapped(stored);
    take(std::span<const T>(row), r % static_cast<std::size_t>(layout.size[1]),
         r / static_cast<std::size_t>(layout.size[1]));
  }
}

/// The same for a type that is known as the program runs: take is called with a span of it.
template <class Take>
void read_any_rows(ByteSource& data, const std::string& name, const VoxelLayout& layout,
                   const Context& context, const Take& take) {
  const auto as = [&]<class T>(T) { read_rows<T>(data, name, layout, context, take); };
  switch (layout.type) {
  case ScalarType::i8:
    return as(std::int8_t{});
  case ScalarType::u8:
    return as(std::uint8_t{});
  case ScalarType::i16:
    return as(std::int16_t{});
  case ScalarType::u16:
    return as(std::uint16_t{});
  case ScalarType::i32:
    return as(std::int32_t{});
  case ScalarType::u32:
    return as(std::uint32_t{});
  case ScalarType::i64:
    return as(std::int64_t{});
  case ScalarType::u64:
    return as(std::uint64_t{});
  case ScalarType::f32:
    return as(float{});
  case ScalarType::f64:
    return as(double{});
  }
}

/// What becomes of a row of labels.
using TakeRow = std::function<void(std::span<const std::int64_t> row)>;

void read_label_rows(ByteSource& data, const std::string& name, const VoxelLayout& layout,
                     const Context& context, const TakeRow& take) {
  std::vector<std::int64_t> labels(static_cast<std::size_t>(layout.size[0]));
  read_any_rows(data, name, layout, context, [&](auto row, std::size_t j, std::size_t k) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::optional<std::int64_t> label = label_of(row[i], layout);
      if (!label)
        throw Error(name, "voxel (" + std::to_string(i) + ", " + std::to_string(j) + ", " +
                              std::to_string(k) + ") is " + value_text(row[i], layout) +
                              ", expected whole numbers");
      labels[i] = *label;
    }
    gewebe::at(name, [&] { take(labels); });
  });
}

void read_grey_rows(ByteSource& data, const std::string& name, const VoxelLayout& layout,
                    const Context& context, std::vector<float>& values) {
  read_any_rows(data, name, layout, context, [&](auto row, std::size_t, std::size_t) {
    for (const auto stored : row)
      values.push_back(
          static_cast<float>(layout.slope * static_cast<double>(stored) + layout.intercept));
  });
}

// Both grow as the bytes come, so that a header's claim alone takes no memory.

/// Appends a row of bits, of the requested labels; returns how many.
std::uint64_t append_bits(std::span<const std::int64_t> row, Counter& counter,
                          labels::LabelMask& mask) {
  mask.bits.resize(mask.bits.size() + mask.row_words());
  std::uint64_t* const words = mask.bits.data() + (mask.bits.size() - mask.row_words());
  std::uint64_t set = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const bool wanted = counter.count(row[i]);
    set += wanted ? 1 : 0;
    words[i >> 6] |= static_cast<std::uint64_t>(wanted) << (i & 63);
  }
  return set;
}

/// Appends a row of runs, of all labels or of the requested ones.
void append_runs(const LabelRequest& request, std::span<const std::int64_t> row, Counter& counter,
                 labels::LabelRuns& labels) {
  for (std::size_t i = 0; i < row.size(); ++i) {
    const bool wanted = counter.count(row[i]) || request.labels.empty();
    const std::int64_t label = wanted ? row[i] : 0;
    if (label < 0 || label > INT32_MAX)
      throw Error("has label " + std::to_string(label) + ", expected 0 to " +
                  std::to_string(INT32_MAX));
    if (i == 0 || label != labels.runs.back().label)
      labels.runs.push_back({0, static_cast<std::int32_t>(label)});
    labels.runs.back().end = static_cast<std::int32_t>(i + 1);
  }
  labels.rows.push_back(labels.runs.size());
  // A vector that grows holds the old content too.
  require_memory(request.context,
                 24.0 * static_cast<double>(labels.runs.size() + labels.rows.size()), "the labels");
}

/// "0 to 4, 7, 9 to 12", of long lists the beginning.
std::string list_of(const std::vector<std::pair<std::int64_t, std::uint64_t>>& labels) {
  std::string text;
  std::size_t parts = 0;
  for (std::size_t n = 0; n < labels.size();) {
    std::size_t last = n;
    while (last + 1 < labels.size() && labels[last + 1].first == labels[last].first + 1)
      ++last;
    text += (text.empty() ? "" : ", ") + std::to_string(labels[n].first);
    if (last > n)
      text += " to " + std::to_string(labels[last].first);
    n = last + 1;
    if (++parts == 20 && n < labels.size())
      return text + ", …";
  }
  return text;
}

AllLabels all_of(ByteSource& source, const std::string& name, const std::vector<LabelRange>& labels,
                 const Context& context, bool side_files) {
  AllLabels result;
  const LabelCheck no_check;
  LabelVolume volume = read_radiology(
      source, name, {labels, context, no_check, side_files, &result.voxels, nullptr});
  result.format = std::move(volume.format);
  result.warnings = std::move(volume.warnings);
  return result;
}

} // namespace

LabelVolume read_radiology(ByteSource& source, const std::string& name,
                           const LabelRequest& request) {
  BufferedBytes raw(source, name);
  std::optional<InflatedBytes> inflated;
  std::optional<BufferedBytes> unpacked;
  BufferedBytes* bytes = &raw;
  if (is_gzip(raw.peek(2))) {
    inflated.emplace(raw, name);
    bytes = &unpacked.emplace(*inflated, name);
  }
  const std::string_view first = bytes->peek(4096);
  LabelVolume volume;
  if (is_nifti(first))
    volume = read_nifti(*bytes, request);
  else if (is_nrrd(first))
    volume = read_nrrd(*bytes, request);
  else if (is_meta_image(first))
    volume = read_meta_image(*bytes, request);
  else if (is_inr(first))
    volume = read_inr(*bytes, request);
  else
    throw Error(name, std::string(request.grey != nullptr ? "is no volume" : "is no label volume") +
                          ", expected NIfTI, NRRD, MetaImage or INR");
  for (const LabelRange& asked : request.labels) {
    const LabelRange range = numbered_label(asked, volume.names, name);
    if (std::none_of(volume.labels.begin(), volume.labels.end(), [&](const auto& label) {
          return label.first >= range.first && label.first <= range.last;
        }))
      throw Error(name, "has no label " + std::to_string(range.first) +
                            (range.last == range.first ? "" : " to " + std::to_string(range.last)) +
                            ", expected some of " + list_of(volume.labels));
  }
  return volume;
}

LabelRange numbered_label(const LabelRange& request,
                          const std::vector<std::pair<std::int64_t, std::string>>& names,
                          const std::string& file) {
  if (request.name.empty())
    return request;
  if (names.empty())
    throw Error(file,
                "has no names of labels, expected a number in place of '" + request.name + "'");
  std::vector<std::string> known;
  std::optional<std::int64_t> found;
  for (const auto& [label, name] : names) {
    known.push_back(name);
    if (name != request.name)
      continue;
    if (found)
      throw Error(file, "has two labels '" + name + "', expected a number instead");
    found = label;
  }
  if (found)
    return {*found, *found, {}};
  std::string list;
  for (const std::string& name : known)
    list += (list.empty() ? "" : ", ") + name;
  throw Error(file, "has no label '" + request.name + "'" +
                        gewebe::text::suggestion(request.name, known) + ", expected some of " +
                        list);
}

// ---- what the formats share

std::size_t bytes_of(ScalarType type) {
  switch (type) {
  case ScalarType::i8:
  case ScalarType::u8:
    return 1;
  case ScalarType::i16:
  case ScalarType::u16:
    return 2;
  case ScalarType::i32:
  case ScalarType::u32:
  case ScalarType::f32:
    return 4;
  case ScalarType::i64:
  case ScalarType::u64:
  case ScalarType::f64:
    return 8;
  }
  return 8;
}

LabelVolume read_voxels(ByteSource& data, const std::string& name, const VoxelLayout& layout,
                        const LabelRequest& request) {
  LabelVolume volume;
  if (request.layout != nullptr) {
    *request.layout = layout;
    return volume;
  }
  volume.mask.size = layout.size;
  volume.mask.transform = layout.transform;
  const double words = static_cast<double>(volume.mask.row_words()) * layout.size[1] *
                       static_cast<double>(layout.size[2]);
  gewebe::at(name, [&] {
    // Twice, for a vector that grows holds the old content too. What comes through here in all
    // counts as well: it may be a small file that grows without end when it is unpacked.
    const double bytes = static_cast<double>(bytes_of(layout.type)) * layout.size[0] *
                         static_cast<double>(layout.size[1]) * layout.size[2];
    const double grey = 8.0 * bytes / static_cast<double>(bytes_of(layout.type));
    const double kept = request.grey != nullptr ? grey : 16 * words + 16.0 * layout.size[0] + 1e6;
    require_memory(request.context, std::max(kept, bytes),
                   (std::string(request.grey != nullptr ? "the volume" : "the label volume") +
                    " of " + size_text(layout.size) + " voxels")
                       .c_str());
    if (request.check)
      request.check(volume.mask);
  });
  Counter counter(request.labels);
  if (request.grey != nullptr) {
    *request.grey = {layout.size, layout.transform, {}};
    read_grey_rows(data, name, layout, request.context, request.grey->values);
  } else if (request.all != nullptr) {
    *request.all = {layout.size, layout.transform, {}, {0}};
    read_label_rows(data, name, layout, request.context, [&](std::span<const std::int64_t> row) {
      append_runs(request, row, counter, *request.all);
    });
  } else {
    read_label_rows(data, name, layout, request.context, [&](std::span<const std::int64_t> row) {
      volume.voxels += append_bits(row, counter, volume.mask);
    });
  }
  char more = 0;
  if (data.read(&more, 1) != 0)
    throw Error(name, "goes on after its " + size_text(layout.size) + " voxels, expected its end");
  volume.labels = counter.result();
  return volume;
}

Int3 checked_size(const std::string& place, const std::array<std::int64_t, 3>& size) {
  Int3 checked{};
  for (std::size_t a = 0; a < 3; ++a) {
    if (size[a] < 1 || size[a] > largest_size)
      throw Error(place, std::to_string(size[a]) + " voxels along axis " + std::to_string(a + 1) +
                             ", expected 1 to 2^20");
    checked[a] = static_cast<std::int32_t>(size[a]);
  }
  return checked;
}

void check_affine(const std::string& place, const volume::GridTransform& transform) {
  for (const double number : transform.m)
    if (!(std::fabs(number) <= 1e12))
      throw Error(place, "the transform to the world has a number that is not finite or beyond "
                         "1e12, expected mm");
  const Vec3 size = transform.voxel_size();
  if (!(size.x >= 1e-12 && size.y >= 1e-12 && size.z >= 1e-12))
    throw Error(place, "a voxel has no extent along an axis, expected a positive spacing");
  if (!(std::fabs(transform.determinant()) > 1e-6 * size.x * size.y * size.z))
    throw Error(place, "the transform to the world is singular, expected three independent axes");
}

namespace {

/// `file` as seen from the folder of `header`.
std::string beside(const std::string& header, std::string_view file) {
  if (leaves_folder(file))
    throw Error(header, "names " + quoted(file) +
                            " as the file of its voxels, expected one in its "
                            "own folder or below");
  const std::size_t slash = header.find_last_of('/');
  return (slash == std::string::npos ? std::string() : header.substr(0, slash + 1)) +
         std::string(file);
}

} // namespace

const HeaderField* HeaderFields::find(const std::string& key) const {
  const auto found = fields_.find(key);
  return found == fields_.end() ? nullptr : &found->second;
}

const HeaderField& HeaderFields::need(const std::string& key) const {
  if (const HeaderField* const field = find(key))
    return *field;
  throw Error(name_, "the " + header_ + " has no field '" + key + "', expected one");
}

void require_no_pipe(const std::string& path) {
  std::error_code failure;
  if (std::filesystem::is_other(path, failure))
    throw Error(path, "is no regular file, expected one beside the header");
}

LabelVolume read_side_file(const std::string& header, const HeaderField& file,
                           const LabelRequest& request,
                           const std::function<LabelVolume(BufferedBytes&)>& read) {
  if (file.value == "LIST" || file.value.starts_with("LIST ") ||
      file.value.find('%') != std::string::npos)
    throw Error(file.place, "several data files, expected one");
  if (!request.side_files)
    throw Error(file.place,
                "the voxels are in another file, expected a file name or one file of both");
  const std::string path = beside(header, file.value);
  require_no_pipe(path);
  Input input(path);
  (void)input.peek(1);
  StreamBytes source(input.stream(), path);
  BufferedBytes data(source, path);
  return read(data);
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r\n\f\v";
  const std::size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string_view::npos)
    return {};
  return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return words;
}

std::string quoted(std::string_view text) {
  std::string shown;
  for (const char c : text.substr(0, 40))
    shown += c >= ' ' && c <= '~' ? c : '?';
  return "'" + shown + (text.size() > 40 ? "…'" : "'");
}

double number_of(const std::string& place, std::string_view word) {
  double value = 0;
  const std::string_view digits = gewebe::text::without_plus(word);
  const auto [rest, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (status != std::errc{} || rest != digits.data() + digits.size() || !std::isfinite(value))
    throw Error(place, quoted(word) + ", expected a finite number");
  return value;
}

std::int64_t whole_of(const std::string& place, std::string_view word) {
  std::int64_t value = 0;
  const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (status != std::errc{} || rest != word.data() + word.size())
    throw Error(place, quoted(word) + ", expected a whole number");
  return value;
}

// ---- the readers

LabelVolume read_label_volume(Input& input, const std::vector<LabelRange>& labels,
                              const Context& context, const LabelCheck& check) {
  (void)input.peek(1); // says that it is empty
  StreamBytes source(input.stream(), input.name());
  return read_radiology(source, input.name(),
                        {labels, context, check, input.name() != "-", nullptr, nullptr});
}

AllLabels read_all_labels(Input& input, const std::vector<LabelRange>& labels,
                          const Context& context) {
  (void)input.peek(1); // says that it is empty
  StreamBytes source(input.stream(), input.name());
  return all_of(source, input.name(), labels, context, input.name() != "-");
}

LabelVolume label_volume_from_bytes(std::string_view bytes, const std::string& name,
                                    const std::vector<LabelRange>& labels, const Context& context,
                                    const LabelCheck& check) {
  MemoryBytes source(bytes);
  return read_radiology(source, name, {labels, context, check, false, nullptr, nullptr});
}

AllLabels all_labels_from_bytes(std::string_view bytes, const std::string& name,
                                const std::vector<LabelRange>& labels, const Context& context) {
  MemoryBytes source(bytes);
  return all_of(source, name, labels, context, false);
}

bool is_label_volume(std::string_view first_bytes) {
  std::string unpacked;
  if (is_gzip(first_bytes)) {
    MemoryBytes memory(first_bytes);
    BufferedBytes packed(memory, "");
    InflatedBytes inflated(packed, "");
    unpacked.resize(4096);
    std::size_t size = 0;
    try {
      while (size < unpacked.size() && inflated.read(unpacked.data() + size, 1) == 1)
        ++size;
    } catch (const Error&) { // it is cut off after 4096 bytes
    }
    unpacked.resize(size);
    first_bytes = unpacked;
  }
  return is_nifti(first_bytes) || is_nrrd(first_bytes) || is_meta_image(first_bytes) ||
         is_inr(first_bytes);
}

} // namespace gewebe::formats
