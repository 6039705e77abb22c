#include "tools/run/scene_record.h"

#include "base/error.h"
#include "formats/scene/scene.h"
#include "model/selector.h"
#include "text/number_text.h"

#include <algorithm>
#include <filesystem>
#include <vector>

namespace gewebe::cli {

namespace {

namespace fs = std::filesystem;

fs::path folder_of(const std::string& file) {
  std::error_code failure;
  fs::path folder = fs::weakly_canonical(
      file == "-" ? fs::path(".") : fs::absolute(fs::path(file)).parent_path(), failure);
  return failure ? fs::path(".") : folder;
}

formats::Output::Options as_part(formats::Output::Options options) {
  options.part = true;
  options.binary = false;
  options.beside = true;
  return options;
}

/// The selector with the numbers of each list that it names as @NAME, @'NAME'.
std::string numbered(const std::string& selector, const std::map<std::string, std::string>& lists) {
  std::string text;
  for (std::size_t at = 0; at < selector.size();) {
    if (selector[at] != '@') {
      text += selector[at++];
      continue;
    }
    const bool quoted = at + 1 < selector.size() && selector[at + 1] == '\'';
    const std::size_t begin = at + (quoted ? 2 : 1);
    const std::size_t end =
        std::min(selector.size(),
                 quoted ? selector.find('\'', begin) : selector.find_first_of(" \t()", begin));
    const std::string name = selector.substr(begin, end - begin);
    std::string numbers;
    for (const auto& [first, last] : model::parse_node_list(lists.at(name), name))
      numbers += (numbers.empty() ? "" : ",") + std::to_string(first) +
                 (last > first ? "-" + std::to_string(last) : "");
    text += numbers.empty() ? "(x<0 and x>=0)" : numbers;
    at = std::min(selector.size(), end + (quoted ? 1 : 0));
  }
  return text;
}

} // namespace

SceneRecord::SceneRecord(const std::string& path, const formats::Output::Options& options,
                         const std::string& scene)
    : output_(path, as_part(options)) {
  std::error_code none;
  if (output_.part() && fs::file_size(output_.temporary(), none) > 0 && !none)
    throw Error(output_.name(), output_.temporary() + " is there, the record of a run that did not "
                                                      "end; expected it moved away or removed");
  if (output_.part())
    output_.keep_part();
  const fs::path from = folder_of(path), to = folder_of(scene);
  if (from != to)
    prefix_ = (to.lexically_relative(from) / "").generic_string();
  if (prefix_.find_first_of("\"\n") != std::string::npos)
    throw Error(output_.name(), "the way from here to the scene's folder holds a quote or a line "
                                "end, which no scene can name, expected a record beside the scene");
}

void SceneRecord::write(std::string_view line) {
  output_.write(line);
  output_.write("\n");
  output_.stream().flush();
}

std::string SceneRecord::moved(const std::string& file) const {
  return file.starts_with('/') ? file : prefix_ + file;
}

void SceneRecord::line(std::string_view text, const formats::Command& command,
                       const std::map<std::string, std::string>& lists) {
  const bool object = std::holds_alternative<formats::ObjectCommand>(command.what);
  const bool model = std::holds_alternative<formats::EmitModelCommand>(command.what);
  const auto* const change = std::get_if<formats::ChangeCommand>(&command.what);
  const bool stage = change != nullptr && !change->stage.empty();
  const bool mesh = change != nullptr && !change->mesh.empty();
  if (object || model || stage || mesh ? prefix_.empty() : lists.empty())
    return write(text);
  std::vector<std::string> words = formats::scene_words(text);
  if (model) {
    words[3] = moved(words[3]);
  } else if (object) {
    words[2] = moved(words[2]);
    for (std::string& word : words)
      if (word.starts_with("store="))
        word = "store=" + moved(word.substr(6));
  } else if (stage) {
    words.back() = "stage=" + moved(change->stage);
  } else if (mesh) { // at [every] T may stand before it
    *(std::ranges::find(words, "instrument") + 3) = moved(change->mesh);
  } else {
    for (std::string& word : words)
      word = numbered(word, lists);
  }
  write(formats::scene_line(words));
}

void SceneRecord::run(double until, double every) {
  write("run " + text::number_text(until) + " every " + text::number_text(every));
}

void SceneRecord::commit() {
  output_.commit();
}

} // namespace gewebe::cli
