#include <iostream>
#include <memory>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/output/printer.h"
#include "client/service/connection.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"

namespace oblique::client {
namespace {

constexpr const char* kWorkersExamples = R"(Examples:
  oblique workers
  oblique workers --server tcp://127.0.0.1:7600 --format csv
  oblique workers --db sweep.db        every worker that delivered a result

A server tells of the workers that are there now.)";

struct WorkersFlags {
  std::string format{"table"};
  SourceFlags source;
};

/// What the holders of keys have, and who was turned away.
void tell_keys(const protocol::WorkersReply& reply) {
  for (const auto& key : reply.keys()) {
    if (!key.name().empty()) {
      tell_line(fmt::format(
          "key {}{}: {} connections, {} studies with {} points open, {} requests refused",
          key.name(), key.role().empty() ? "" : fmt::format(" ({})", key.role()), key.connections(),
          key.open_studies(), key.open_points(), key.refused()));
    }
  }
  std::string refusals;
  for (const auto& of_cause : reply.refusals()) {
    refusals +=
        fmt::format("{} {} ({})", refusals.empty() ? "" : ",", of_cause.reason(), of_cause.peers());
  }
  if (!refusals.empty()) {
    tell_line("turned away since the server began:" + refusals);
  }
}

protocol::QueryReply workers_of_server(const ConnectionSettings& settings) {
  protocol::QueryReply table;
  for (const char* column :
       {"worker", "name", "threads", "instruction_set", "solver_version", "leased_points",
        "solved_points", "silent_ms", "losses", "standing", "key"}) {
    table.add_columns(column);
  }
  const auto reply = Connection(settings).workers();
  tell_if_insecure(reply.access(), settings.server_url);
  for (const auto& worker : reply.workers()) {
    auto& row = *table.add_rows();
    add_value(row, static_cast<std::int64_t>(worker.worker_id()));
    add_value(row, worker.name());
    add_value(row, static_cast<std::int64_t>(worker.threads()));
    add_value(row, worker.instruction_set());
    add_value(row, worker.solver_version());
    add_value(row, static_cast<std::int64_t>(worker.leased_points()));
    add_value(row, static_cast<std::int64_t>(worker.solved_points()));
    add_value(row, static_cast<std::int64_t>(worker.silent_ms()));
    add_value(row, static_cast<std::int64_t>(worker.losses()));
    add_value(row, std::string(worker.set_aside() ? "set aside"
                               : worker.proven()  ? "proven"
                                                  : "new"));
    add_value(row, worker.key());
  }
  if (reply.bad_frames() > 0) {
    std::cerr << fmt::format(
        "{} frames came that no sound worker or client sends; the server's log says from whom\n",
        reply.bad_frames());
  }
  tell_keys(reply);
  return table;
}

int workers(const WorkersFlags& flags) {
  const auto format = format_named(flags.format);
  if (flags.source.database.empty()) {
    print_out(workers_of_server(connection_settings(flags.source)), format);
    return kDone;
  }
  const auto source = open_database(flags.source.database);
  print_out(
      source->query("SELECT worker_id AS worker, name, threads, instruction_set, solver_version, "
                    "joined_at FROM workers ORDER BY worker_id"),
      format);
  return kDone;
}

}  // namespace

void add_workers(CLI::App& app, Command& command) {
  auto flags = std::make_shared<WorkersFlags>();
  auto* verb = app.add_subcommand("workers", "List the workers of a server");
  verb->footer(kWorkersExamples);
  add_format_flag(*verb, flags->format);
  verb->add_option("--db", flags->source.database, "database to read directly instead")
      ->type_name("FILE");
  add_server_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return workers(*flags); }; });
}

}  // namespace oblique::client
