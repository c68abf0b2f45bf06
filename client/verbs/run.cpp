#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include "client/output/value_notes.h"
#include "client/service/connection.h"
#include "client/service/run_service.h"
#include "client/study/study_flags.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/tip_reach.h"
#include "client/verbs/verbs.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"

namespace oblique::client {
namespace {

constexpr const char* kRunExamples = R"(Examples:
  oblique run deploy/studies/paper.toml
  oblique run --H 1 --mu 0.1:2.0:40 --e 0.6,0.8,1 --name friction
  oblique run sweep.toml --db sweep.db --workers 4

Ctrl-C stops it and loses nothing: the same command again goes on where it stopped. Other studies of
the database that are not finished wait meanwhile.
The exit code is 1 when a point failed, too.)";

struct RunFlags {
  StudyFlags study;
  RunSettings settings;
};

int run(const RunFlags& flags) {
  const auto study = study_of_flags(flags.study, tip_reach());
  judge_points(study);
  check_settings(flags.settings);
  tell_values(std::cerr, study.recipe);
  // Before any thread is started; see StopSignals.
  protocol::StopSignals stop;
  const auto end = run_study(study, flags.settings, stop);
  if (!end) {
    return stop.exit_code();
  }
  print_first(end->rows, end->status.points());
  std::cerr << "More: oblique query " << shell_word(study.name) << " --db "
            << shell_word(flags.settings.service.database.string()) << "\n";
  return end->exit_code;
}

}  // namespace

void add_run(CLI::App& app, Command& command) {
  auto flags = std::make_shared<RunFlags>();
  auto* verb = app.add_subcommand(
      "run", "Run a study on this machine: server, workers and database in one command");
  verb->footer(kRunExamples);
  verb->add_option("--db", flags->settings.service.database, "database, made when it is not there")
      ->type_name("FILE")
      ->capture_default_str();
  verb->add_flag(
      "--allow-network-disk", flags->settings.service.allow_network_disk,
      "take a database on a network file system, where a second machine could damage it");
  verb->add_flag(
      "--no-reuse", flags->settings.no_reuse,
      "solve every point, also those of which another study of the database has the result");
  add_worker_flags(*verb, flags->settings);
  verb->add_option("--rows", flags->settings.rows, "most rows of the table shown at the end")
      ->check(protocol::whole_number_from(0))
      ->type_name("N")
      ->capture_default_str();
  add_study_flags(*verb, flags->study, command.names_single_lengths);
  verb->callback([flags, &command] { command = [flags] { return run(*flags); }; });
}

}  // namespace oblique::client
