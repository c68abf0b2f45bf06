#include <iostream>
#include <memory>
#include <string>
#include <utility>

#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/verbs.h"

namespace oblique::client {
namespace {

constexpr const char* kWatchExamples = R"(Examples:
  oblique watch paper
  oblique watch paper --db sweep.db
  oblique watch paper --server tcp://127.0.0.1:7600

Ctrl-C ends the watching; the study goes on. A server that falls silent is waited for. The exit
code is 1 when a point failed, or when the study is not done.)";

struct WatchFlags {
  std::string study;
  SourceFlags source;
};

int watch(const WatchFlags& flags) {
  protocol::StopSignals stop;
  const auto source = open_source(flags.source, [&stop] { return !stop.requested(); });
  bool answered = false;
  const auto ask = [&](const Tell& tell) {
    // Where nobody ever answered, the address may be wrong.
    auto status = study_named(*source, flags.study, answered ? tell : Tell());
    if (!std::exchange(answered, true)) {
      tell_if_insecure(source->access(), source->place());
    }
    return status;
  };
  try {
    const auto status = watch_study(ask, stop);
    if (!stop.requested()) {
      return tell_end(status, [&](const std::string& sql) { return source->query(sql); });
    }
  } catch (const Interrupted&) {
    // Told below.
  }
  std::cerr << "No longer watching.\n";
  return stop.exit_code();
}

}  // namespace

void add_watch(CLI::App& app, Command& command) {
  auto flags = std::make_shared<WatchFlags>();
  auto* verb = app.add_subcommand("watch", "Show the progress of a study until it is done");
  verb->footer(kWatchExamples);
  verb->add_option("STUDY", flags->study, "name of the study")->required()->type_name("");
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return watch(*flags); }; });
}

}  // namespace oblique::client
