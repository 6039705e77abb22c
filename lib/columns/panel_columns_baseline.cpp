#include "columns/panel_columns_body_internal.h"

namespace gewebe::columns {

void take_panel_baseline(const PanelRows& rows, std::span<double* const> column,
                         const double* weight, double* sum) {
  take(rows, column, weight, sum);
}

} // namespace gewebe::columns
