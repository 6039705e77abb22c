#pragma once
// Label volumes of radiology: NIfTI-1 and -2 (.nii, .nii.gz, pairs .hdr/.img), NRRD (.nrrd, .nhdr;
// raw and gzip), MetaImage (.mha, .mhd; raw and zlib) and INRIMAGE-4 (.inr, .inr.gz). What is read
// is which voxels have one of the requested labels, one bit a voxel, or the labels of all voxels as
// runs, and where they lie in the world: mm, RAS.
//
// A reader of our own on zlib. Debian 12 has three libraries. nifticlib 3 (1.8 MB) opens files by
// name alone, so no pipe; it warns on standard error and reads a file that is cut off as zeros, and
// for a header that claims 32000³ voxels allocates 1.6 GB, for its product overflows. teem (3.3 MB)
// reads NRRD only. ITK (126 MB, 38 packages) reads all three. All hold the whole volume in its own
// type, eight to sixty-four times the bits that are needed here. The headers are a page of code
// each; streamed through zlib (which libpng and HDF5 need anyway) a volume takes one bit a voxel,
// and no byte is believed before it is checked.
//
// Frames: NIfTI is RAS; its affine is chosen as by nibabel (sform where sform_code > 0, else qform
// where qform_code > 0, else the voxel sizes about the middle with x from right to left, and a
// warning), its unit (m, mm, µm) applied. NRRD spaces RAS, LAS and LPS are converted by negating
// axes; one without anatomical meaning is taken as RAS with a warning. MetaImage is LPS. INR has
// voxel sizes alone, from the first voxel on, which are taken as RAS with a warning.

#include "base/context.h"
#include "formats/stream/stream.h"
#include "labels/label_mask.h"
#include "labels/label_runs.h"

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gewebe::formats {

/// Requested labels: one where both are equal, or those in between that the volume holds; or the
/// one of a name, where that is not empty.
struct LabelRange {
  std::int64_t first = 0, last = 0;
  std::string name{};
};

struct LabelVolume {
  labels::LabelMask mask;   ///< of the requested labels
  std::uint64_t voxels = 0; ///< that are set in it
  std::string format;       ///< "NIfTI-1", "NIfTI-2", "NRRD", "MetaImage", "INR"
  std::vector<std::pair<std::int64_t, std::uint64_t>>
      labels; ///< all values that the file holds, ascending, and how often
  /// Names of labels, as 3D Slicer writes them into .seg.nrrd; in the order of its segments.
  std::vector<std::pair<std::int64_t, std::string>> names;
  std::vector<std::string> warnings;
};

/// Check of the mask's size and place by the caller, before a voxel is unpacked: it throws to
/// refuse.
using LabelCheck = std::function<void(const labels::LabelMask& without_bits)>;

/// Reads forwards, from a pipe too; only files of two parts (.hdr, .nhdr, .mhd) need a name.
/// Compression is detected by its bytes. Values must be whole numbers, in whatever type they are
/// kept.
/// \throw Error with the place if it is none of these, is cut off, goes on beyond its end, or has a
/// value that is no whole number; if the affine is singular; if none of a range of `labels` occurs
/// (the message names those that do); if a name is requested that the file has not, or has twice;
/// if more than context.max_memory would be needed; or what `check` throws
LabelVolume read_label_volume(Input& input, const std::vector<LabelRange>& labels,
                              const Context& context, const LabelCheck& check = {});

/// The same for bytes that are there already; `name` is for messages. Files of two parts are
/// refused.
LabelVolume label_volume_from_bytes(std::string_view bytes, const std::string& name,
                                    const std::vector<LabelRange>& labels, const Context& context,
                                    const LabelCheck& check = {});

struct AllLabels {
  labels::LabelRuns voxels;
  std::string format; ///< as above
  std::vector<std::string> warnings;
};

/// Reads the same files for the labels of all voxels; those that `labels`, where there are any, do
/// not want become 0. \throw Error as read_label_volume, and if a requested label is below 0 or
/// above 2^31 - 1, or the runs would need more than context.max_memory
AllLabels read_all_labels(Input& input, const std::vector<LabelRange>& labels,
                          const Context& context);
AllLabels all_labels_from_bytes(std::string_view bytes, const std::string& name,
                                const std::vector<LabelRange>& labels, const Context& context);

/// Are these first bytes (the more the better, up to 4096) those of a label volume, compressed or
/// not?
bool is_label_volume(std::string_view first_bytes);

} // namespace gewebe::formats
