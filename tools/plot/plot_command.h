#pragma once
// gewebe plot: curves of a table, gewebe-plot(1).

namespace gewebe::cli {

/// \param argv  from the word "plot" on \return exit status
int run_plot(int argc, char** argv);

} // namespace gewebe::cli
