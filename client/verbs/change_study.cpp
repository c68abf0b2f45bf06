#include <iostream>
#include <memory>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/service/connection.h"
#include "client/service/source_flags.h"
#include "client/verbs/verbs.h"
#include "proto/result_message.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

struct ChangeFlags {
  std::string study;
  SourceFlags source;
};

int change(const ChangeFlags& flags, protocol::StudyChange change) {
  Connection connection(connection_settings(flags.source));
  const auto reply = connection.change(flags.study, change);
  const auto& status = reply.study();
  const std::string again =
      change == protocol::STUDY_CHANGE_RETRY
          ? fmt::format(", {} failed ones to be solved again", shown_count(reply.retried()))
          : "";
  std::cout << fmt::format("{}: {}, {} of {} points done{}\n", protocol::visible(status.name()),
                           protocol::visible(status.state()),
                           shown_count(protocol::completed_points(status)),
                           shown_count(status.points()), again);
  return kDone;
}

/// A verb that asks a server to change how a study goes.
void add_change(CLI::App& app, Command& command, const std::string& name,
                const std::string& description, const std::string& remark,
                protocol::StudyChange what) {
  auto flags = std::make_shared<ChangeFlags>();
  auto* verb = app.add_subcommand(name, description);
  verb->footer(fmt::format(
      "Examples:\n  oblique {0} friction\n  oblique {0} friction --server tcp://127.0.0.1:7600\n\n"
      "{1}",
      name, remark));
  verb->add_option("STUDY", flags->study, "name of the study")->required()->type_name("");
  add_server_flags(*verb, flags->source);
  verb->callback(
      [flags, &command, what] { command = [flags, what] { return change(*flags, what); }; });
}

}  // namespace

void add_cancel(CLI::App& app, Command& command) {
  add_change(app, command, "cancel", "Stop solving a study",
             "Workers drop what they have of it. What is solved stays in the database; `oblique\n"
             "resume`, or submitting the same study again, goes on with it.",
             protocol::STUDY_CHANGE_CANCEL);
}

void add_pause(CLI::App& app, Command& command) {
  add_change(app, command, "pause", "Hand out no more points of a study",
             "Points that are handed out are still solved and kept. `oblique resume` goes on.",
             protocol::STUDY_CHANGE_PAUSE);
}

void add_resume(CLI::App& app, Command& command) {
  add_change(app, command, "resume", "Go on with a paused or cancelled study",
             "A study that runs or is done stays as it is.", protocol::STUDY_CHANGE_RESUME);
}

void add_retry(CLI::App& app, Command& command) {
  add_change(
      app, command, "retry", "Solve the failed points of a study again",
      "Their rows are removed, and the points handed out like new ones. Points fail for a\n"
      "reason, which `oblique query STUDY --where \"status = 'failed'\"` shows; retry once it\n"
      "is gone.",
      protocol::STUDY_CHANGE_RETRY);
}

}  // namespace oblique::client
