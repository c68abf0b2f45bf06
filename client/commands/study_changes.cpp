#include <unistd.h>

#include <iostream>
#include <optional>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/io/console.h"
#include "client/service/connection.h"
#include "client/service/watching.h"
#include "client/study/study_file.h"
#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
#include "proto/text.h"
#include "server/maintenance/study_changes_offline.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kDescribeExamples = R"(Examples:
  oblique describe friction
  oblique describe friction > friction.toml
  oblique describe friction --server tcp://127.0.0.1:7600

Prints a study file that defines the same points in the same order. The original file or flags are
not stored. Blocks appended to the file extend the study (`oblique submit --help`).)";

constexpr const char* kRenameExamples = R"(Examples:
  oblique rename friction friction-paper
  oblique rename friction friction-paper --db lab.db
  oblique rename friction friction-paper --server tcp://127.0.0.1:7600

The study keeps its number, points and results; `oblique watch` continues. A database file is
changed directly if no server uses it; otherwise name the server.)";

constexpr const char* kDeleteExamples = R"(Examples:
  oblique delete friction
  oblique delete friction --yes --db lab.db
  oblique delete friction --server tcp://127.0.0.1:7600

Deletes the study and all its results; they cannot be restored, so make a copy with `oblique backup`
first. Asks for confirmation on a terminal; elsewhere --yes is required. A running study is stopped.
Its name is free at once; a server removes the rows in the background. The file keeps its size; later
results use the space. A database file is changed directly if no server uses it.)";

struct ChangeFlags {
  std::string study;
  std::string new_name;
  bool yes = false;
  SourceFlags source;
};

template <protocol::StudyChange what>
int change(const ChangeFlags& flags, Console& console) {
  Connection connection(connection_settings(console, flags.source));
  const auto reply = connection.change(flags.study, what);
  const auto& status = reply.study();
  const std::string again =
      what == protocol::STUDY_CHANGE_RETRY
          ? fmt::format(", {} failed points will be solved again", format_count(reply.retried()))
          : "";
  console.out() << fmt::format("{}: {}, {} of {} points done{}\n", protocol::visible(status.name()),
                               protocol::visible(status.state()),
                               format_count(protocol::completed_points(status)),
                               format_count(status.points()), again);
  return kDone;
}

int describe(const ChangeFlags& flags, Console& console) {
  console.out() << study_toml(flags.study, stored_recipe(console, flags.source, flags.study));
  return kDone;
}

int rename(const ChangeFlags& flags, Console& console) {
  if (const auto objection = protocol::study_name_error(flags.new_name); !objection.empty()) {
    throw solver::InputError(objection);
  }
  const std::string database = database_meant(flags.source);
  if (database.empty()) {
    Connection connection(connection_settings(console, flags.source));
    const auto study = study_named(connection, flags.study);
    connection.change(study.name(), protocol::STUDY_CHANGE_RENAME, study.study_id(),
                      flags.new_name);
  } else {
    const auto study = study_named(*open_source(console, flags.source), flags.study);
    server::rename_study(database, study.study_id(), flags.new_name);
  }
  console.out() << fmt::format("{} is now called {}\n", protocol::visible(flags.study),
                               protocol::visible(flags.new_name));
  return kDone;
}

/// Prompts at the terminal; returns whether the user agrees.
bool is_confirmed(Console& console, const protocol::StudyStatus& study, const std::string& place) {
  console.errors() << fmt::format(
      "Delete {}, {}, with {} points, {} of them with results, from {}? [y/N] ",
      protocol::visible(study.name()), protocol::visible(study.state()),
      format_count(study.points()), format_count(study.solved() + study.failed()), place);
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

int delete_study(const ChangeFlags& flags, Console& console) {
  if (!flags.yes && (isatty(STDIN_FILENO) == 0 || !console.can_redraw())) {
    throw solver::InputError(
        "deleting needs a confirmation, and standard input is no terminal: add --yes");
  }
  const std::string database = database_meant(flags.source);
  std::optional<Connection> connection;
  if (database.empty()) {
    connection.emplace(connection_settings(console, flags.source));
  }
  auto study = connection ? study_named(*connection, flags.study)
                          : study_named(*open_source(console, flags.source), flags.study);
  if (!flags.yes && !is_confirmed(console, study, connection ? connection->url() : database)) {
    console.notes() << "Nothing was deleted.\n";
    return kFailed;
  }
  if (connection) {
    study =
        connection->change(study.name(), protocol::STUDY_CHANGE_DELETE, study.study_id()).study();
  } else if (!server::delete_study(database, study.study_id())) {
    console.note(fmt::format(
        "Another program reads {}: the next server removes the remaining rows.", database));
  }
  console.out() << fmt::format("{} is deleted: {} points, {} results\n",
                               protocol::visible(study.name()), format_count(study.points()),
                               format_count(study.solved() + study.failed()));
  return kDone;
}

/// Adds a command that changes the state of a study on a server.
template <protocol::StudyChange what>
void add_change(CLI::App& app, Action& parsed, const std::string& name, const std::string& summary,
                const std::string& remark) {
  auto [command, flags] =
      new_command(app, parsed, name, summary,
                  fmt::format("Examples:\n  oblique {0} friction\n"
                              "  oblique {0} friction --server tcp://127.0.0.1:7600\n\n{1}",
                              name, remark),
                  change<what>);
  add_study_argument(command, flags.study);
  add_server_flags(command, flags.source);
}

}  // namespace

void add_study_changes(CLI::App& app, Action& parsed) {
  add_change<protocol::STUDY_CHANGE_CANCEL>(
      app, parsed, "cancel", "Stop solving a study",
      "Workers drop its points. Results stay in the database; `oblique resume`, or\nsubmitting the "
      "same study again, continues it.");
  add_change<protocol::STUDY_CHANGE_PAUSE>(
      app, parsed, "pause", "Stop leasing points of a study",
      "Points that workers already have are solved and stored. `oblique resume` continues.");
  add_change<protocol::STUDY_CHANGE_RESUME>(app, parsed, "resume",
                                            "Continue a paused or cancelled study",
                                            "A study that runs or is done stays as it is.");
  add_change<protocol::STUDY_CHANGE_RETRY>(
      app, parsed, "retry", "Solve the failed points of a study again",
      "Their rows are removed and the points become open again. The reasons of failures are shown "
      "by\n`oblique query STUDY --where \"status = 'failed'\"`; remove the cause first.");
  {
    auto [command, flags] = new_command(app, parsed, "describe", "Print a study as a study file",
                                        kDescribeExamples, describe);
    add_study_argument(command, flags.study);
    add_source_flags(command, flags.source);
  }
  {
    auto [command, flags] =
        new_command(app, parsed, "rename", "Rename a study", kRenameExamples, rename);
    command.add_option("OLD", flags.study, "name of the study")->required()->type_name("");
    command.add_option("NEW", flags.new_name, "new name, which no other study may have")
        ->required()
        ->type_name("");
    add_source_flags(command, flags.source);
  }
  auto [command, flags] = new_command(app, parsed, "delete", "Delete a study with all its results",
                                      kDeleteExamples, delete_study);
  add_study_argument(command, flags.study);
  command.add_flag("-y,--yes", flags.yes, "do not ask for confirmation");
  add_source_flags(command, flags.source);
}

}  // namespace oblique::client
