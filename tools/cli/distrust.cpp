#include "tools/cli/distrust.h"

#include "tools/cli/progress_bar.h"

#include <cstdio>

namespace gewebe::cli {

void distrust(Run& run, const std::string& tool, const std::string& text) {
  const std::string line = progress_eraser() + tool + ": warning: " + text + "\n";
  (void)std::fwrite(line.data(), 1, line.size(), stderr); // in one piece beside other programs'
  run.stats().set("distrusted", true);
}

} // namespace gewebe::cli
