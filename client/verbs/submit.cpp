#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/output/mesh_note.h"
#include "client/output/value_notes.h"
#include "client/service/connection.h"
#include "client/service/source.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/study/study_flags.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/tip_reach.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

constexpr const char* kSubmitExamples = R"(Examples:
  oblique submit deploy/studies/paper.toml
  oblique submit sweep.toml --server tcp://127.0.0.1:7600 --watch
  oblique submit sweep.toml --rows 20      watch it, then show 20 points
  oblique submit --H 1 --mu 0.1:2.0:40 --e 0.6,0.8,1 --name friction

A study is safe in the server's database once this returns. Submitting the same study again
goes on with it. One whose blocks begin with those that the server has grows by the rest, and runs
again, whether it was done, paused or cancelled; so does one whose last block is a random or Sobol
sample with a larger count. Any other study under a taken name is refused, with what differs.)";

struct SubmitFlags {
  StudyFlags study;
  SourceFlags source;
  bool watch = false;
  std::optional<std::int64_t> rows;  ///< of the table shown at the end; watches too
  SubmitSettings settings;
};

void tell_submitted(const Study& study, const protocol::SubmitReply& reply,
                    const SubmitSettings& settings) {
  std::string known;
  if (!reply.created()) {
    known = reply.appended() > 0
                ? fmt::format("; {} points are appended to it, which was {}",
                              shown_count(reply.appended()), protocol::visible(reply.was()))
                : "; the server had it already";
    if (settings.priority) {
      known += fmt::format("; its priority is now {}", *settings.priority);
    }
  }
  if (const std::string taken = taken_over(reply.taken()); !taken.empty()) {
    known += "; " + taken;
  }
  std::cout << fmt::format("{}: {} points, {} done{}", study.name, shown_count(reply.points()),
                           shown_count(reply.settled()), known)
            << std::endl;
}

/// The command that asks this server for more of a study.
std::string query_for_more(const Study& study, const ConnectionSettings& server) {
  const std::string key = server.key ? server.key->path : "";
  return fmt::format("oblique query {} --server {}{}", shell_word(study.name),
                     shell_word(server.server_url),
                     key.empty() ? "" : " --keys " + shell_word(key));
}

int watch(const Study& study, std::int64_t rows, const std::string& for_more,
          Connection& connection, protocol::StopSignals& stop) {
  const auto ask = [&](const Tell& tell) { return study_named(connection, study.name, tell); };
  const auto status = watch_study(ask, stop);
  if (stop.requested()) {
    throw Interrupted("no longer watching");
  }
  const auto query = [&](const std::string& sql) { return connection.query(sql, tell_line); };
  if (rows > 0) {
    print_first(connection.chunks(first_results(study.name, rows), tell_line), status.points());
    std::cerr << "More: " << for_more << '\n';
  }
  return tell_end(status, query);
}

int submit(const SubmitFlags& flags) {
  if (const std::string objection =
          protocol::objection_to_priority(flags.settings.priority.value_or(0));
      !objection.empty()) {
    throw solver::InputError("--priority: " + objection);
  }
  const auto study = study_of_flags(flags.study, tip_reach());
  judge_points(study);
  protocol::StopSignals stop;
  const auto server = connection_settings(flags.source);
  Connection connection(server, [&stop] { return !stop.requested(); });
  bool submitted = false;
  try {
    const auto reply = connection.submit(study, flags.settings);
    tell_submitted(study, reply, flags.settings);
    if (reply.created()) {
      tell_mesh(std::cerr, study.recipe);
    }
    tell_values(std::cerr, study.recipe);
    submitted = true;
    return flags.watch || flags.rows ? watch(study, flags.rows.value_or(0),
                                             query_for_more(study, server), connection, stop)
                                     : kDone;
  } catch (const Interrupted&) {
    std::cerr << (submitted ? "No longer watching; the study goes on at "
                            : "Stopped before the server answered; it may have the study: ")
              << connection.url() << ".\n";
    return stop.exit_code();
  }
}

}  // namespace

void add_submit(CLI::App& app, Command& command) {
  auto flags = std::make_shared<SubmitFlags>();
  auto* verb = app.add_subcommand("submit", "Hand a study to a server");
  verb->footer(kSubmitExamples);
  add_server_flags(*verb, flags->source);
  verb->add_flag("--watch", flags->watch, "show the progress until the study is done");
  verb->add_option("--rows", flags->rows,
                   "watch, and show a table with so many rows at most when the study is done")
      ->check(protocol::whole_number_from(0))
      ->type_name("N");
  verb->add_option("--priority", flags->settings.priority,
                   fmt::format("studies of a higher priority come first, {}; 0 unless told",
                               protocol::kPriorities))
      ->type_name("N");
  verb->add_flag(
      "--no-reuse", flags->settings.no_reuse,
      "solve every point, also those of which another study of the database has the result");
  add_study_flags(*verb, flags->study, command.names_single_lengths);
  verb->callback([flags, &command] { command = [flags] { return submit(*flags); }; });
}

}  // namespace oblique::client
