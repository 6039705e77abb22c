#pragma once
// Parsers of the words behind the first one of a line: questions.

#include "formats/scene/command.h"
#include "formats/scene/words.h"

namespace gewebe::formats {

using What = decltype(Command::what);

What parse_emit(Words& in);
What parse_step(Words& in);
What parse_run(Words& in);
What parse_sync(Words& in);
What parse_end(Words& in);
What parse_nodes(Words& in);
What parse_select(Words& in);
What parse_objects(Words& in);
What parse_instruments(Words& in);

} // namespace gewebe::formats
