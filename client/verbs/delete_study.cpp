#include <iostream>
#include <memory>
#include <string>

#include <unistd.h>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/verbs.h"
#include "proto/text.h"
#include "server/maintenance/study_changes_offline.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kDeleteExamples = R"(Examples:
  oblique delete friction
  oblique delete friction --yes --db lab.db
  oblique delete friction --server tcp://127.0.0.1:7600

The study and all its results are gone for good: `oblique backup` makes a copy first. On a terminal
it asks; elsewhere it wants --yes. Workers drop what they have of a study that runs, its name is free
at once, and a server deletes the rows meanwhile. The file keeps its size: later results use the room.
A database file is changed directly, when no server works on it.)";

struct DeleteFlags {
  std::string study;
  bool yes = false;
  SourceFlags source;
};

/// Whether who sits at the terminal says yes.
bool is_confirmed(const protocol::StudyStatus& study, const std::string& place) {
  std::cerr << fmt::format("Delete {}, {}, {} points of which {} have results, from {}? [y/N] ",
                           protocol::visible(study.name()), protocol::visible(study.state()),
                           shown_count(study.points()),
                           shown_count(study.solved() + study.failed()), place);
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

/// In a database file. Prints a note when rows are left to the next server.
void delete_from(const std::string& database, const protocol::StudyStatus& study) {
  if (!server::delete_study(database, study.study_id())) {
    std::cerr << fmt::format(
        "Another program reads {}: the next server deletes what is left of the study.\n", database);
  }
}

int delete_study(const DeleteFlags& flags) {
  const std::string database = database_meant(flags.source);
  const bool asks = !flags.yes;
  if (asks && (isatty(STDIN_FILENO) == 0 || isatty(STDERR_FILENO) == 0)) {
    throw solver::InputError(
        "nobody can be asked here whether the study is to be deleted: --yes says so");
  }
  protocol::StudyStatus study;
  if (database.empty()) {
    Connection connection(connection_settings(flags.source));
    study = study_named(connection, flags.study);
    if (asks && !is_confirmed(study, connection.url())) {
      std::cerr << "Nothing is deleted.\n";
      return kFailed;
    }
    study =
        connection.change(study.name(), protocol::STUDY_CHANGE_DELETE, study.study_id()).study();
  } else {
    study = study_named(*open_source(flags.source), flags.study);
    if (asks && !is_confirmed(study, database)) {
      std::cerr << "Nothing is deleted.\n";
      return kFailed;
    }
    delete_from(database, study);
  }
  std::cout << fmt::format("{} is deleted: {} points, {} results\n",
                           protocol::visible(study.name()), shown_count(study.points()),
                           shown_count(study.solved() + study.failed()));
  return kDone;
}

}  // namespace

void add_delete(CLI::App& app, Command& command) {
  auto flags = std::make_shared<DeleteFlags>();
  auto* verb = app.add_subcommand("delete", "Delete a study with all its results");
  verb->footer(kDeleteExamples);
  verb->add_option("STUDY", flags->study, "name of the study")->required()->type_name("");
  verb->add_flag("-y,--yes", flags->yes, "do not ask");
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return delete_study(*flags); }; });
}

}  // namespace oblique::client
