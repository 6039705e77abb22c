#include "formats/curves/number_table.h"

#include "base/error.h"
#include "text/nearest_word.h"
#include "text/number_text.h"
#include "text/utf8.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

namespace gewebe::formats {

namespace {

constexpr std::size_t most_columns = 10000, longest_name = 300;

/// The line that the text begins with, which is taken away; without its end.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (line.ends_with('\r'))
    line.remove_suffix(1);
  return line;
}

/// Cells of a line, quotes taken off. \throw Error
std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t k = 0; k < line.size(); ++k) {
    const char c = line[k];
    if (c == '"' && quoted && k + 1 < line.size() && line[k + 1] == '"') {
      cells.back() += c;
      ++k;
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  if (quoted)
    throw Error("a quote without end, expected '\"' behind it in the same line");
  return cells;
}

void check_name(std::string_view name) {
  if (name.empty())
    throw Error("a column without a name, expected one in the first line");
  if (name.size() > longest_name)
    throw Error("a name of " + std::to_string(name.size()) + " bytes, expected up to " +
                std::to_string(longest_name));
  while (!name.empty()) {
    const std::size_t size = gewebe::text::utf8_size(name);
    const auto first = static_cast<unsigned char>(name[0]);
    if (size == 0 || first < 0x20 || first == 0x7f)
      throw Error("a name that is no UTF-8 text, expected names in the first line");
    name.remove_prefix(size);
  }
}

NumberColumn named_column(std::string_view text) {
  check_name(text);
  NumberColumn column;
  column.name = text;
  const std::size_t open = text.rfind(" [");
  if (text.ends_with(']') && open != std::string_view::npos && open > 0) {
    column.name = text.substr(0, open);
    column.unit = text.substr(open + 2, text.size() - open - 3);
  }
  return column;
}

/// NaN for an empty cell or "nan"; nothing if it is no number.
std::optional<double> number_of(std::string_view cell) {
  while (cell.starts_with(' '))
    cell.remove_prefix(1);
  while (cell.ends_with(' '))
    cell.remove_suffix(1);
  double value = std::numeric_limits<double>::quiet_NaN();
  if (cell.empty())
    return value;
  cell = gewebe::text::without_plus(cell);
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || std::isinf(value))
    return std::nullopt;
  return value;
}

std::string with_unit(const NumberColumn& column) {
  return column.name + (column.unit.empty() ? "" : " [" + column.unit + "]");
}

} // namespace

NumberTable read_number_table(std::string_view text, const std::string& name) {
  NumberTable table;
  for (std::size_t line = 1; !text.empty(); ++line)
    gewebe::at(name + ":" + std::to_string(line), [&] {
      const std::string_view row = take_line(text);
      if (row.empty() || row.starts_with('#'))
        return;
      const std::vector<std::string> cells = cells_of(row);
      if (table.columns.empty()) {
        if (cells.size() > most_columns)
          throw Error("over " + std::to_string(most_columns) + " columns, expected fewer");
        for (const std::string& cell : cells)
          table.columns.push_back(named_column(cell));
        return;
      }
      if (cells.size() != table.columns.size())
        throw Error(std::to_string(cells.size()) + " cells, expected " +
                    std::to_string(table.columns.size()) + " as in the first line");
      for (std::size_t k = 0; k < cells.size(); ++k) {
        NumberColumn& column = table.columns[k];
        const std::optional<double> value = number_of(cells[k]);
        if (!value && column.words.empty())
          column.words = "'" + cells[k].substr(0, 40) + "' in line " + std::to_string(line);
        column.values.push_back(value.value_or(std::numeric_limits<double>::quiet_NaN()));
      }
    });
  if (table.columns.empty())
    throw Error(name, "no columns, expected their names in the first line");
  return table;
}

std::string column_list(const NumberTable& table) {
  std::string list;
  for (const NumberColumn& column : table.columns)
    list += (list.empty() ? "" : ", ") + with_unit(column);
  return list;
}

const NumberColumn& find_column(const NumberTable& table, std::string_view name) {
  std::vector<const NumberColumn*> found;
  for (const NumberColumn& column : table.columns)
    if (column.name == name || with_unit(column) == name)
      return column;
  for (const NumberColumn& column : table.columns)
    if (column.name.ends_with("." + std::string(name)))
      found.push_back(&column);
  if (found.size() == 1)
    return *found[0];
  const std::string asked = "'" + std::string(name) + "'";
  if (found.empty()) {
    std::vector<std::string> known;
    for (const NumberColumn& column : table.columns) {
      known.push_back(column.name);
      known.push_back(column.name.substr(column.name.rfind('.') + 1)); // all, if there is no '.'
    }
    throw UsageError("no column " + asked + gewebe::text::suggestion(name, known) +
                     ", expected one of " + column_list(table));
  }
  std::string list;
  for (const NumberColumn* const column : found)
    list += (list.empty() ? "" : ", ") + column->name;
  throw UsageError("several columns " + asked + ", expected one of " + list);
}

} // namespace gewebe::formats
