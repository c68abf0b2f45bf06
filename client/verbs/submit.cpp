#include <cstdint>
#include <iostream>
#include <memory>

#include "client/output/mesh_note.h"
#include "client/service/connection.h"
#include "client/service/source.h"
#include "client/service/watching.h"
#include "client/study/point_flags.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"

namespace oblique::client {
namespace {

constexpr const char* kSubmitExamples = R"(Examples:
  oblique submit deploy/studies/paper.toml
  oblique submit sweep.toml --server tcp://127.0.0.1:7600 --watch
  oblique submit --H 1 --mu 0.1:2.0:40 --e 0.6,0.8,1 --name friction

A study is safe in the server's database once this returns. Submitting the same study again
goes on with it; another study under a taken name is refused.)";

struct SubmitFlags {
  StudyFlags study;
  SourceFlags source;
  bool watch = false;
  StudyTerms terms;
};

void tell_submitted(const Study& study, const protocol::SubmitReply& reply) {
  std::cout << study.name << ": " << reply.points() << " points, " << reply.settled() << " done"
            << (reply.created() ? "" : "; the server had it already") << std::endl;
}

int watch(const Study& study, Connection& connection, StopSignal& stop) {
  const auto ask = [&](const Tell& tell) {
    const auto status = connection.status(study.name, tell);
    if (status.studies_size() != 1) {
      throw ServerError("the server no longer knows the study \"" + study.name + "\"");
    }
    return status.studies(0);
  };
  const auto status = watch_study(ask, stop);
  if (stop.requested()) {
    throw Interrupted("no longer watching");
  }
  const std::uint64_t servers_limit = 0;
  return tell_end(status, [&](const std::string& sql) {
    return connection.query(sql, servers_limit, tell_line);
  });
}

int submit(const SubmitFlags& flags) {
  const auto study = study_of_flags(flags.study);
  StopSignal stop;
  Connection connection(connection_settings(flags.source), [&stop] { return !stop.requested(); });
  bool submitted = false;
  try {
    tell_submitted(study, connection.submit(study, flags.terms));
    tell_mesh(std::cerr, study.recipe);
    submitted = true;
    return flags.watch ? watch(study, connection, stop) : kDone;
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
  verb->add_option("--priority", flags->terms.priority,
                   "studies of a higher priority come first, -1000 to 1000; 0 unless told")
      ->check(CLI::Range(-1000, 1000))
      ->type_name("N");
  verb->add_option(
          "--weight", flags->terms.weight,
          "share of the workers among studies of one priority, 0.001 to 1000; 1 unless told")
      ->check(protocol::number_between(0.001, 1000.0))
      ->type_name("W");
  verb->add_flag("--mix-versions", flags->terms.mixes_versions,
                 "workers of any solver version take part; the column solver_version says which "
                 "solved a point");
  add_study_flags(*verb, flags->study);
  verb->callback([flags, &command] { command = [flags] { return submit(*flags); }; });
}

}  // namespace oblique::client
