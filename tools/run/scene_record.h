#pragma once
// A record of a scene: the lines that were accepted, as a scene that does the same again.

#include "formats/scene/command.h"
#include "formats/stream/stream.h"

#include <map>
#include <string>
#include <string_view>

namespace gewebe::cli {

class SceneRecord {
public:
  /// While it grows it is PATH.part, which holds all lines so far whatever ends the program; names
  /// of files count from the record's folder. \param scene the recorded one, as in scene_files
  /// \throw Error, UsageError as Output; Error if the folder of the scene has a name that no line
  /// can hold
  SceneRecord(const std::string& path, const formats::Output::Options& options,
              const std::string& scene);

  /// A line that was carried out. \param lists the node lists that it names, and their text: the
  /// record has the numbers instead   \throw Error
  void line(std::string_view text, const formats::Command& command,
            const std::map<std::string, std::string>& lists);
  /// The part of a `run` that was carried out before it failed.
  void run(double until, double every);
  /// It appears. \throw Error
  void commit();

private:
  void write(std::string_view line);
  std::string moved(const std::string& file) const;

  formats::Output output_;
  std::string prefix_; ///< of relative names; none if they count from the same folder
};

} // namespace gewebe::cli
