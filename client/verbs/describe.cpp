#include <iostream>
#include <memory>
#include <string>

#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/study/study_toml.h"
#include "client/verbs/verbs.h"
#include "server/maintenance/study_changes_offline.h"

namespace oblique::client {
namespace {

constexpr const char* kDescribeExamples = R"(Examples:
  oblique describe friction
  oblique describe friction > friction.toml
  oblique describe friction --server tcp://127.0.0.1:7600

Prints a study file that gives the same study: the same points, in the same order, of the same models.
How it was first written, in a file or by flags, is not kept. Appended to, the file lets the study grow
(`oblique submit --help`).)";

struct DescribeFlags {
  std::string study;
  SourceFlags source;
};

protocol::Recipe recipe_of(const DescribeFlags& flags) {
  const std::string database = database_meant(flags.source);
  if (database.empty()) {
    return Connection(connection_settings(flags.source)).describe(flags.study);
  }
  const auto study = study_named(*open_source(flags.source), flags.study);
  return server::stored_recipe(database, study.study_id());
}

int describe(const DescribeFlags& flags) {
  std::cout << study_toml(flags.study, recipe_of(flags));
  return kDone;
}

}  // namespace

void add_describe(CLI::App& app, Command& command) {
  auto flags = std::make_shared<DescribeFlags>();
  auto* verb = app.add_subcommand("describe", "Print the study file of a study");
  verb->footer(kDescribeExamples);
  verb->add_option("STUDY", flags->study, "name of the study")->required()->type_name("");
  add_source_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return describe(*flags); }; });
}

}  // namespace oblique::client
