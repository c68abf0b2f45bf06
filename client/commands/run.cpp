#include <string>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/service/run_service.h"
#include "client/study/point_flags.h"
#include "client/study/study.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"

namespace oblique::client {
namespace {

constexpr const char* kRunExamples = R"(Examples:
  oblique run deploy/studies/paper.toml
  oblique run --H 1 --mu 0.1:2.0:40 --e 0.6,0.8,1 --name friction
  oblique run sweep.toml --db sweep.db --workers 4

Ctrl-C stops the run and loses nothing: the same command continues it. Other unfinished studies of
the database wait meanwhile. The exit code is 1 if a point failed.)";

struct RunFlags {
  StudyFlags study;
  RunSettings settings;
};

int run(const RunFlags& flags, Console& console) {
  const auto study = checked_study(console, flags.study);
  refuse_used_database(flags.settings.service.database);
  note_unusual_values(console.notes(), study.recipe);
  // created before any thread starts; see StopSignals
  protocol::StopSignals stop;
  const auto end = run_study(console, study, flags.settings, stop);
  if (!end) {
    return stop.exit_code();
  }
  print_first(console, end->rows, end->status.points());
  console.notes() << "More: oblique query " << shell_word(study.name) << " --db "
                  << shell_word(flags.settings.service.database.string()) << "\n";
  return end->exit_code;
}

}  // namespace

void add_run(CLI::App& app, Action& parsed) {
  auto [command, flags] = new_command(
      app, parsed, "run", "Solve a study on this machine, with a temporary server and workers",
      kRunExamples, run);
  auto& settings = flags.settings;
  command.add_option("--db", settings.service.database, "database; created if it does not exist")
      ->type_name("FILE")
      ->capture_default_str();
  add_network_disk_flag(command, settings.service.allow_network_disk);
  add_no_reuse_flag(command, settings.no_reuse);
  add_worker_flags(command, settings);
  command.add_option("--limit", settings.rows, "number of rows shown at the end")
      ->check(protocol::whole_number_from(0))
      ->type_name("N")
      ->capture_default_str();
  add_study_flags(command, flags.study);
}

}  // namespace oblique::client
