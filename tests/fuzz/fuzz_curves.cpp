// Any table as curves: an Error, or drawings of two kinds.

#include "base/error.h"
#include "formats/curves/curve_sheet.h"
#include "formats/curves/number_table.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const gewebe::formats::NumberTable table = gewebe::formats::read_number_table(text, "-");
    for (const gewebe::formats::NumberColumn& y : table.columns) {
      const std::vector<const gewebe::formats::NumberColumn*> ys{&y};
      try {
        const gewebe::formats::CurveSheet sheet =
            gewebe::formats::curve_sheet(table.columns.front(), ys, y.name);
        if (gewebe::formats::curves_svg(sheet, 200, 150).empty() ||
            gewebe::formats::curves_ascii(sheet, 40, 10).empty())
          std::abort();
      } catch (const gewebe::Error&) { // words, or no numbers
      }
    }
  } catch (const gewebe::Error&) { // what bad input is for
  }
  return 0;
}
