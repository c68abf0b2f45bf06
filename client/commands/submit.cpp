#include <cstdint>
#include <optional>
#include <ostream>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/io/console.h"
#include "client/service/connection.h"
#include "client/service/source.h"
#include "client/service/watching.h"
#include "client/study/point_flags.h"
#include "client/study/study.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kSubmitExamples = R"(Examples:
  oblique submit deploy/studies/paper.toml
  oblique submit sweep.toml --server tcp://127.0.0.1:7600 --watch
  oblique submit sweep.toml --limit 20     watch it, then show 20 points
  oblique submit --H 1 --mu 0.1:2.0:40 --e 0.6,0.8,1 --name friction

When the command returns, the server has stored the study. Submitting the same study again continues
it. A study may grow: if its blocks begin with those of the stored study of that name, or its last
block is a random or Sobol sample with a larger count, the new points are added and it runs again,
whether it was done, paused or cancelled. Any other study of a used name is refused with the
difference.)";

struct SubmitFlags {
  StudyFlags study;
  SourceFlags source;
  bool watch = false;
  std::optional<std::int64_t> limit;  ///< rows of the table at the end; implies --watch
  SubmitSettings settings;
};

void print_submitted(Console& console, const Study& study, const protocol::SubmitReply& reply,
                     const SubmitSettings& settings) {
  std::string known;
  if (!reply.created()) {
    known = reply.appended() > 0
                ? fmt::format("; {} points are added to the {} it had",
                              format_count(reply.appended()), protocol::visible(reply.was()))
                : "; the server already had it";
    if (settings.priority) {
      known += fmt::format("; its priority is now {}", *settings.priority);
    }
  }
  if (const std::string taken = reused_points_note(reply.reused()); !taken.empty()) {
    known += "; " + taken;
  }
  console.out() << fmt::format("{}: {} points, {} done{}", study.name, format_count(reply.points()),
                               format_count(reply.completed()), known)
                << std::endl;
}

int watch(Console& console, const SubmitFlags& flags, const Study& study, Connection& connection,
          protocol::StopSignals& stop) {
  FollowedStudy followed(connection, study.name);
  const auto ask = [&](const Tell& tell) { return followed.status(tell); };
  const auto status = watch_study(console, ask, stop);
  if (stop.requested()) {
    throw Interrupted("watching ended");
  }
  const Tell tell = tell_errors(console);
  if (const auto rows = flags.limit.value_or(0); rows > 0) {
    print_first(console, connection.chunks(request_for({.study = study.name, .limit = rows}), tell),
                status.points());
    const auto server = connection_settings(console, flags.source);
    console.notes() << fmt::format("More: oblique query {} --server {}{}\n", shell_word(study.name),
                                   shell_word(server.server_url),
                                   server.key ? " --keys " + shell_word(server.key->path) : "");
  }
  return print_end(console, status,
                   [&](const std::string& sql) { return connection.query(sql, tell); });
}

int submit(const SubmitFlags& flags, Console& console) {
  if (const std::string objection = protocol::priority_error(flags.settings.priority.value_or(0));
      !objection.empty()) {
    throw solver::InputError("--priority: " + objection);
  }
  const auto study = checked_study(console, flags.study);
  protocol::StopSignals stop;
  Connection connection(connection_settings(console, flags.source),
                        [&stop] { return !stop.requested(); });
  bool submitted = false;
  try {
    const auto reply = connection.submit(study, flags.settings);
    print_submitted(console, study, reply, flags.settings);
    if (reply.created()) {
      note_coarse_mesh(console.notes(), study.recipe);
    }
    note_unusual_values(console.notes(), study.recipe);
    submitted = true;
    return flags.watch || flags.limit ? watch(console, flags, study, connection, stop) : kDone;
  } catch (const Interrupted&) {
    console.notes() << (submitted
                            ? "Watching ended; the study continues on "
                            : "Stopped before the server answered; it may have stored the study: ")
                    << connection.url() << ".\n";
    return stop.exit_code();
  }
}

}  // namespace

void add_submit(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "submit", "Submit a study to a server", kSubmitExamples, submit);
  add_server_flags(command, flags.source);
  command.add_flag("--watch", flags.watch, "show the progress until the study is done");
  command
      .add_option("--limit", flags.limit,
                  "watch, and show a table with this many rows when the study is done")
      ->check(protocol::whole_number_from(0))
      ->type_name("N");
  command
      .add_option("--priority", flags.settings.priority,
                  fmt::format("studies of higher priority come first, {}; default: 0",
                              protocol::kPriorities))
      ->type_name("N");
  add_no_reuse_flag(command, flags.settings.no_reuse);
  add_study_flags(command, flags.study);
}

}  // namespace oblique::client
