// Any bytes as a label volume and as a scan: an Error, or a mask, runs and values, never a crash,
// and no memory beyond the limit; small ones become a density too.

#include "base/error.h"
#include "formats/volume/grey_volume.h"
#include "formats/volume/label_volume.h"
#include "labels/grey_density.h"
#include "labels/label_density.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gewebe;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  Context context;
  context.threads = 1;
  context.max_memory = std::uint64_t{64} << 20U;
  (void)formats::is_label_volume(bytes.substr(0, 4096));
  try {
    const formats::LabelVolume volume =
        formats::label_volume_from_bytes(bytes, "fuzz", {{3, 3}}, context);
    const Int3& n = volume.mask.size;
    if (volume.mask.bits.size() != volume.mask.row(0, n[2]) || volume.voxels == 0)
      std::abort();
    if (std::int64_t{n[0]} * n[1] * n[2] < 4096)
      (void)labels::label_density(context, volume.mask, {}).digest();
  } catch (const Error&) { // what bad input is for
  }
  try {
    const labels::LabelRuns all = formats::all_labels_from_bytes(bytes, "fuzz", {}, context).voxels;
    if (all.rows.size() !=
            static_cast<std::size_t>(all.size[1]) * static_cast<std::size_t>(all.size[2]) + 1 ||
        all.rows.back() != all.runs.size() || all.runs.back().end != all.size[0])
      std::abort();
  } catch (const Error&) {
  }
  try {
    const labels::GreyVolume scan = formats::grey_volume_from_bytes(bytes, "fuzz", context).volume;
    if (scan.values.size() != scan.row(0, scan.size[2]))
      std::abort();
    if (scan.values.size() < 4096) {
      labels::GreyDensityOptions options;
      options.low = 2;
      (void)labels::grey_density(context, scan, options).digest();
    }
  } catch (const Error&) {
  }
  return 0;
}
