#include "tools/run/run_arguments.h"

#include "base/error.h"

#include <utility>

namespace gewebe {

void RunArguments::declare(cli::Program& p) {
  result.declare(p);
  p.flag("--serve", serve, "answer a wrong line and go on");
  p.flag("--ack", acknowledge, "with --serve, answer each line by its number at last");
  p.option("--listen", listen, "PATH", "with --serve, a socket for clients, one at a time");
  p.option("--shapes-in", shapes, "FILE", "with --serve, where others map all shapes");
  p.flag("--busy-wait", awake, "with --serve, wait for lines without sleep");
  p.flag("--binary", binary, "answer in binary frames of float32");
  p.option("--events", events, "FILE", "who touched what when, as CSV");
  p.option("--record", record, "FILE", "what was accepted, as a scene that does it again");
  p.option("--tolerance", tolerance, "E",
           "error that shapes may have, of their largest displacement")
      .range(0, 0.1);
  p.flag("--verify", verify, "fail unless every shape is as exact as it should be");
  p.option("--rate", rate, "HZ", "steps a second that are wanted").positive();
  p.option("--latencies", latencies, "FILE", "how long each step took to answer, as CSV");
  p.flag("--no-partial", no_partial, "keep no frames of a run that fails or is interrupted");
  p.option("--recover", recover, "FILE", "keep the frames that a killed run has left of FILE");
  p.operand("SCENE", scene, "the scene");
  p.check([this, &p] {
    for (const auto& [given, option] : {std::pair{acknowledge, "--ack"},
                                        {!listen.empty(), "--listen"},
                                        {awake, "--busy-wait"},
                                        {!shapes.empty(), "--shapes-in"}})
      if (given && !serve)
        throw UsageError(std::string(option) + " without --serve, expected both");
    result.check(p);
  });
}

} // namespace gewebe
