#include <iostream>
#include <memory>
#include <string>

#include "client/connection.h"
#include "client/source.h"
#include "client/verbs.h"

namespace oblique::client {
namespace {

constexpr const char* kExamples = R"(Examples:
  oblique cancel friction
  oblique cancel friction --server tcp://127.0.0.1:7600

What is solved stays in the database; submitting the same study again goes on with it.)";

struct CancelFlags {
  std::string study;
  SourceFlags source;
};

int cancel(const CancelFlags& flags) {
  Connection connection(connection_settings(flags.source));
  const auto status = connection.cancel(flags.study);
  std::cout << status.name() << ": " << status.state() << ", " << status.solved() + status.failed()
            << " of " << status.points() << " points done\n";
  return kDone;
}

}  // namespace

void add_cancel(CLI::App& app, Command& command) {
  auto flags = std::make_shared<CancelFlags>();
  auto* verb = app.add_subcommand("cancel", "Stop solving a study");
  verb->footer(kExamples);
  verb->add_option("STUDY", flags->study, "name of the study")->required()->type_name("");
  add_server_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return cancel(*flags); }; });
}

}  // namespace oblique::client
