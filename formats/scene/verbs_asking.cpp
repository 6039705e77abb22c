#include "formats/scene/verbs_internal.h"

#include <string>
#include <utility>

namespace gewebe::formats {

What parse_emit(Words& in) {
  const std::string& word = in.word("word");
  if (word == "model") {
    EmitModelCommand c;
    c.object = in.name();
    c.file = in.word("FILE");
    if (c.file.empty())
      in.fail("an empty name of a file");
    return c;
  }
  if (word == "stress") {
    EmitStressCommand c;
    c.object = in.name();
    if (!in.done())
      c.nodes = in.nodes();
    return c;
  }
  if (word != "shapes" && word != "surfaces" && word != "forces" && word != "instruments")
    in.fail(shown(word) + " can't be emitted");
  return ChangeCommand{
      .change = scene::Emit{word == "forces", word == "instruments", word == "surfaces"}};
}

What parse_step(Words& in) {
  StepCommand c;
  if (in.done())
    return c;
  c.dt = in.number("time");
  if (!(*c.dt >= 0))
    in.fail("a step back in time");
  return c;
}

What parse_run(Words& in) {
  RunCommand c;
  c.until = in.number("time");
  if (!in.take("every"))
    in.fail(in.done() ? "no 'every'" : shown(in.word("")) + " is not 'every'");
  c.every = in.number("time");
  if (!(c.every > 0))
    in.fail("DT is not positive");
  return c;
}

What parse_sync(Words&) {
  return SyncCommand{};
}

What parse_end(Words&) {
  return EndCommand{};
}

What parse_nodes(Words& in) {
  QueryCommand c{.kind = QueryCommand::Kind::nodes, .object = in.name()};
  if (in.take("rest"))
    c.positions = QueryCommand::Positions::rest;
  else if (in.take("positions"))
    c.positions = QueryCommand::Positions::now;
  return c;
}

What parse_select(Words& in) {
  QueryCommand c{.kind = QueryCommand::Kind::select, .object = in.name()};
  c.nodes = in.nodes();
  return c;
}

What parse_objects(Words&) {
  return QueryCommand{.kind = QueryCommand::Kind::objects};
}

What parse_instruments(Words&) {
  return QueryCommand{.kind = QueryCommand::Kind::instruments};
}

} // namespace gewebe::formats
