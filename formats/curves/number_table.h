#pragma once
// Tables of numbers as CSV: a line of names, then rows.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

struct NumberColumn {
  std::string name;           ///< "probe.force"
  std::string unit;           ///< "uN", or empty
  std::vector<double> values; ///< by row; NaN where the cell is empty
  std::string words;          ///< first cell that is no number, with its line; empty: all are
};

struct NumberTable {
  std::vector<NumberColumn> columns;
};

/// Names are UTF-8, a unit is in brackets at their end: "probe.force [uN]". Cells may be quoted.
/// \throw Error, place "NAME:LINE"
NumberTable read_number_table(std::string_view text, const std::string& name);

/// The column of that name, with or without its unit, else the only one whose name has this last
/// part: "force" is "probe.force". \throw UsageError that lists the columns, if there is none or
/// there are several
const NumberColumn& find_column(const NumberTable& table, std::string_view name);

/// "time [s], probe.force [uN]".
std::string column_list(const NumberTable& table);

} // namespace gewebe::formats
