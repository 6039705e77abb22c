#include "tools/run/run_arguments.h"

#include "base/error.h"

#include <utility>

namespace gewebe::cli {

void RunArguments::declare(cli::Program& p) {
  result.declare(p);
  p.flag("--serve", serve, "answer a wrong line by an error and go on");
  p.flag("--ack", acknowledge, "with --serve: end the answer to each line by ok or error");
  p.option("--listen", listen, "PATH", "with --serve: Unix socket whose clients drive the scene");
  p.option("--shapes-in", shapes, "FILE",
           "with --serve: file with all shapes, for other programs to map");
  p.flag("--busy-wait", awake, "with --serve: poll for lines instead of sleeping");
  p.flag("--binary", binary, "answer in binary frames of float32");
  p.option("--events", events, "FILE",
           "write contacts, instruments and commands over time, as CSV");
  p.option("--record", record, "FILE", "write the accepted lines as a scene that replays the run");
  p.option("--tolerance", tolerance, "E",
           "error allowed in shapes, relative to their largest displacement")
      .range(0, 0.1);
  p.flag("--verify", verify, "measure the error of every shape and fail if one is too large");
  p.flag("--estimate", estimate, "answer the errors that meshes of solids cause");
  p.option("--rate", rate, "HZ", "steps per second that you need; late ones are counted")
      .positive();
  p.option("--latencies", latencies, "FILE", "write the time to answer each step, as CSV");
  p.flag("--no-partial", no_partial, "keep no frames of a run that fails or is interrupted");
  p.option("--recover", recover, "FILE", "recover the frames of a killed run whose result is FILE");
  p.operand("SCENE", scene, "scene, - for standard input");
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

} // namespace gewebe::cli
