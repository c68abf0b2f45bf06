#include <iostream>
#include <memory>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/verbs.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"
#include "server/maintenance/study_changes_offline.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kRenameExamples = R"(Examples:
  oblique rename friction friction-paper
  oblique rename friction friction-paper --db lab.db
  oblique rename friction friction-paper --server tcp://127.0.0.1:7600

The study keeps its number, its points and its results; who watches it goes on watching. A database
file is changed directly, when no server works on it; else its server must be asked.)";

struct RenameFlags {
  std::string study;
  std::string name;
  SourceFlags source;
};

int rename(const RenameFlags& flags) {
  if (const auto objection = protocol::objection_to_study_name(flags.name); !objection.empty()) {
    throw solver::InputError(objection);
  }
  const std::string database = database_meant(flags.source);
  if (database.empty()) {
    Connection connection(connection_settings(flags.source));
    const auto study = study_named(connection, flags.study);
    connection.change(study.name(), protocol::STUDY_CHANGE_RENAME, study.study_id(), flags.name);
  } else {
    const auto study = study_named(*open_source(flags.source), flags.study);
    server::rename_study(database, study.study_id(), flags.name);
  }
  std::cout << fmt::format("{} is called {} now\n", protocol::visible(flags.study),
                           protocol::visible(flags.name));
  return kDone;
}

}  // namespace

void add_rename(CLI::App& app, Command& command) {
  auto flags = std::make_shared<RenameFlags>();
  auto* verb = app.add_subcommand("rename", "Give a study another name");
  verb->footer(kRenameExamples);
  verb->add_option("OLD", flags->study, "name of the study")->required()->type_name("");
  verb->add_option("NEW", flags->name, "its new name, which no other study may have")
      ->required()
      ->type_name("");
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return rename(*flags); }; });
}

}  // namespace oblique::client
