// ffe-precompute: model -> stiffness store.

#include "formats/stream/file_names.h"
#include "tools/store/store_making.h"
#include "tools/store/store_merging.h"
#include "tools/store/store_update.h"

#include <array>
#include <csignal>
#include <cstring>
#include <unistd.h>

using namespace gewebe;
namespace {

/// The store that second stages are added to.
std::optional<formats::StiffnessStore> first_stages(const cli::Run& run,
                                                    const cli::StoreArguments& a) {
  if (a.stage == 1)
    return std::nullopt;
  return formats::StiffnessStore(run.output());
}

void discard(formats::Output& output, formats::StiffnessStoreWriter& writer) {
  output.keep_part(false);
  writer.remove_journal();
}

std::array<char, 4400> interrupted{}; ///< message of a signal
std::array<struct sigaction, 64> before{};

extern "C" void gewebe_tell_interrupted(int signal_number) {
  if (::write(2, interrupted.data(), std::strlen(interrupted.data())) < 0)
    interrupted[0] = 0;
  before.at(static_cast<std::size_t>(signal_number)).sa_handler(signal_number);
}

/// From now on a signal that ends the program prints that finished work is kept.
void tell_when_interrupted(const std::string& part) {
  const std::string text = "ffe-precompute: interrupted, " + part.substr(0, 4096) +
                           " keeps the columns so far: the same command goes on from there\n";
  text.copy(interrupted.data(), interrupted.size() - 1);
  for (const int signal_number : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction& old = before.at(static_cast<std::size_t>(signal_number));
    if (::sigaction(signal_number, nullptr, &old) != 0 || old.sa_handler == SIG_IGN ||
        old.sa_handler == SIG_DFL)
      continue;
    struct sigaction action = old;
    action.sa_handler = gewebe_tell_interrupted;
    (void)::sigaction(signal_number, &action, nullptr);
  }
}

void work(cli::Run& run, const cli::StoreArguments& a) {
  const bool in_place = !a.update.empty() && run.output() == "-";
  const std::string& path = in_place ? a.update : run.output();
  if (path == "-")
    throw UsageError("expected -o FILE, since a store cannot go to standard output");
  (void)formats::output_kind("", path, formats::Kind::hdf5, {formats::Kind::hdf5});
  formats::Output::Options options = run.output_options(true);
  options.sync = true;
  const std::optional<formats::StiffnessStore> first = first_stages(run, a);
  std::optional<formats::StiffnessStore> before_cut;
  if (!a.update.empty())
    before_cut.emplace(a.update);
  options.part = a.touched.has_value() && !a.compress && !first;
  if (in_place || first)
    formats::allow_in_place(path);
  formats::Output output(path, options);
  // What is no file is refused before the work.
  formats::StiffnessStoreWriter writer(output, first ? first->shard() : a.shard);
  if (options.part)
    tell_when_interrupted(output.temporary());
  cli::StoreTotals totals;
  try {
    if (first)
      cli::copy_store(*first, writer, totals);
    if (before_cut)
      cli::update_store(run, a, *before_cut, writer, totals);
    else if (a.merge)
      run.timed("merge", [&] { cli::merge_stores(a.inputs, writer, totals); });
    else
      cli::add_models(run, a, first ? &*first : nullptr, writer, totals);
    writer.close();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    // What can't be written, or stands in the way, is kept; what is wrong would end the same again.
    if (error.place() != output.name() && !error.place().starts_with(path + ".part"))
      discard(output, writer);
    throw;
  }
  try {
    if (a.verify) // what the disk holds, before it takes its name
      run.timed("verify",
                [&] { cli::verify_store(run, formats::StiffnessStore(output.temporary()), path); });
  } catch (const Error&) {
    discard(output, writer);
    throw;
  }
  output.commit();
  writer.remove_journal();
  if (run.stats_wanted())
    cli::report_store(run, path, totals, writer);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("ffe-precompute",
                 "Factorises the stiffness of models and stores it, with columns of its "
                 "inverse on request.");
  cli::StoreArguments a;
  cli::declare(p, a);
  p.check([&] { cli::complete(a); });
  return p.run(argc, argv, [&](cli::Run& run) {
    a.info ? cli::print_store(run, a.inputs[0], a.verify) : work(run, a);
  });
}
