// gewebe: starts the programs beside it, gewebe(1).

#include "base/error.h"
#include "formats/stream/stream.h"
#include "text/nearest_word.h"
#include "tools/cli/messages.h"
#include "tools/cli/starter_texts.h"
#include "tools/cli/tool_list.h"
#include "tools/cli/version.h"
#include "tools/plot/plot_command.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <unistd.h>
#include <vector>

extern "C" const char gewebe_standard_makefile[]; // tools/standard.mk

using namespace gewebe;

namespace {

namespace fs = std::filesystem;

/// Becomes that program. \throw Error if it can't be run
[[noreturn]] void become(const std::string& path, std::vector<std::string> words) {
  std::vector<char*> arguments;
  for (std::string& word : words)
    arguments.push_back(word.data());
  arguments.push_back(nullptr);
  (void)(path.find('/') == std::string::npos ? ::execvp(path.c_str(), arguments.data())
                                             : ::execv(path.c_str(), arguments.data()));
  throw Error(path + ": cannot run it: " + std::strerror(errno));
}

/// Where this program is: the others are there too.
fs::path here() {
  return fs::read_symlink("/proc/self/exe").parent_path();
}

[[noreturn]] void start(const std::string& tool, std::vector<std::string> words) {
  words[0] = tool;
  become((here() / tool).string(), std::move(words));
}

/// The file of a manual page: NAME, gewebe-NAME or gewebe_NAME; where the programs are installed.
/// What is no program's page is also looked for in the tree that they are built in.
std::optional<std::string> page_file(const std::string& name) {
  std::error_code failure;
  for (const std::string& whole : {name, "gewebe-" + name, "gewebe_" + name})
    for (const std::string section : {"1", "5", "7"}) {
      const std::string file = whole + "." + section;
      const fs::path folder = here() / "../share/man" / ("man" + section);
      for (const fs::path& path :
           {folder / file, folder / (file + ".gz"), here() / "../../man" / file})
        if (fs::exists(path, failure) && (path.parent_path() == folder || !cli::is_tool(name)))
          return path.lexically_normal().string();
    }
  return std::nullopt;
}

void write_text(const std::string& text) {
  formats::Output output("-", {.binary = false});
  output.write(text);
  output.commit();
}

/// The page, where there are one and a `man`, or else what the program says itself.
void show_help(const std::string& page) {
  const std::optional<std::string> file = page_file(page);
  try {
    if (file)
      become("man", {"man", "-l", *file});
  } catch (const Error&) {
    if (!cli::is_tool(page))
      throw;
  }
  if (!cli::is_tool(page))
    throw Error("no page '" + page + "', expected a program or a page that gewebe(7) names");
  start(page, {"", "--help"});
}

void work(const std::vector<std::string>& words) {
  const std::string word = words.size() > 1 ? words[1] : "";
  if (cli::is_tool(word))
    start(word, {words.begin() + 1, words.end()});
  if (word.empty())
    throw UsageError("expected a program, see gewebe --list");
  if (word == "help" && words.size() == 3)
    return show_help(words[2]);
  if (const std::string_view how = cli::way_to(word); !how.empty())
    throw UsageError("no program '" + word + "', but " + std::string(how) + ", see gewebe --list");
  if (words.size() > 2)
    throw UsageError("unexpected '" + words[2] + "' after " + word + ", see gewebe --help");
  if (word == "-h" || word == "--help" || word == "help")
    return write_text(cli::starter_help());
  if (word == "--help-json")
    return write_text(cli::starter_help_json());
  if (word == "--list")
    return write_text(cli::tool_list());
  if (word == "--makefile")
    return write_text(gewebe_standard_makefile);
  if (word == "--version")
    return write_text(cli::version_text("gewebe"));
  std::vector<std::string> known{"plot",   "help",       "--help",   "--help-json",
                                 "--list", "--makefile", "--version"};
  std::ranges::copy(cli::tool_names(), std::back_inserter(known));
  throw UsageError("no program '" + word + "'" + text::suggestion(word, known) +
                   ", see gewebe --list");
}

} // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "plot")
    return cli::run_plot(argc - 1, argv + 1);
  try {
    work({argv, argv + argc});
    return 0;
  } catch (const UsageError& error) {
    cli::print_message("gewebe", error.what());
    return 2;
  } catch (const std::exception& error) {
    cli::print_message("gewebe", error.what());
  }
  return 1;
}
