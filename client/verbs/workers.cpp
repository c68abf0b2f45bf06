#include <algorithm>
#include <iostream>
#include <memory>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/output/printer.h"
#include "client/service/connection.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"
#include "proto/text.h"

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

/// "1 frame", "2 frames".
std::string counted(std::uint64_t count, const char* one, const char* several) {
  return fmt::format("{} {}", shown_count(count), count == 1 ? one : several);
}

/// The cause of a refusal. A peer without a key uses another mechanism.
std::string shown_cause(const protocol::WorkersReply& reply, const std::string& reason) {
  const bool is_mechanism = reason == "other mechanism";
  return !is_mechanism              ? reason
         : reply.access() == "keys" ? "without a key"
                                    : "with a key, where there are none";
}

/// Prints how many peers were refused, and how many frames were malformed.
void tell_access(const protocol::WorkersReply& reply) {
  std::string refusals;
  for (const auto& of_cause : reply.refusals()) {
    if (of_cause.peers() > 0) {
      refusals += fmt::format("{} {} ({})", refusals.empty() ? "" : ",",
                              shown_cause(reply, of_cause.reason()), of_cause.peers());
    }
  }
  if (!refusals.empty()) {
    tell_line("turned away since the server began:" + refusals);
  }
  if (reply.bad_frames() > 0) {
    tell_line(
        fmt::format("{} came that no sound worker or client sends; the server's log says from whom",
                    counted(reply.bad_frames(), "frame", "frames")));
  }
}

std::string standing_of(const protocol::WorkerStatus& worker) {
  return worker.set_aside() ? "set aside" : worker.proven() ? "proven" : "new";
}

/// All that is known, for programs.
protocol::Table full_table(const protocol::WorkersReply& reply) {
  protocol::Table table{.columns = {"worker", "name", "threads", "instruction_set",
                                    "solver_version", "leased_points", "solved_points", "silent_ms",
                                    "losses", "standing", "host", "points_per_s", "state", "key"}};
  for (const auto& worker : reply.workers()) {
    auto& row = table.rows.emplace_back();
    add_value(row, static_cast<std::int64_t>(worker.worker_id()));
    add_value(row, worker.name());
    add_value(row, static_cast<std::int64_t>(worker.threads()));
    add_value(row, worker.instruction_set());
    add_value(row, worker.solver_version());
    add_value(row, static_cast<std::int64_t>(worker.leased_points()));
    add_value(row, static_cast<std::int64_t>(worker.solved_points()));
    add_value(row, static_cast<std::int64_t>(worker.silent_ms()));
    add_value(row, static_cast<std::int64_t>(worker.losses()));
    add_value(row, standing_of(worker));
    add_value(row, worker.host());
    add_value(row, worker.points_per_s());
    add_value(row, worker.state());
    add_value(row, worker.key());
  }
  return table;
}

/// What people look for, in 100 columns. A name that begins with the host goes on without it.
protocol::Table table_for_people(const protocol::WorkersReply& reply) {
  constexpr double kMillisecondsASecond = 1000.0;
  const bool has_keys = std::any_of(reply.workers().begin(), reply.workers().end(),
                                    [](const auto& worker) { return !worker.key().empty(); });
  const std::size_t host_bytes = has_keys ? 12 : 18;
  const std::size_t name_bytes = has_keys ? 10 : 12;
  constexpr std::size_t kKeyBytes = 9;
  protocol::Table table{.columns = {"worker", "host", "name", "threads", "cpu", "version",
                                    "points/s", "silent", "state"}};
  if (has_keys) {
    table.columns.emplace_back("key");
  }
  for (const auto& worker : reply.workers()) {
    const bool has_host = !worker.host().empty() && worker.name().starts_with(worker.host() + ":");
    const std::string name =
        has_host ? worker.name().substr(worker.host().size() + 1) : worker.name();
    auto& row = table.rows.emplace_back();
    add_value(row, static_cast<std::int64_t>(worker.worker_id()));
    add_value(row, protocol::shortened(worker.host(), host_bytes));
    add_value(row, protocol::shortened(name, name_bytes));
    add_value(row, static_cast<std::int64_t>(worker.threads()));
    add_value(row, worker.instruction_set());
    add_value(row, worker.solver_version());
    add_value(row, shown_rate(worker.points_per_s()));
    add_value(row, shown_duration(worker.silent_ms() / kMillisecondsASecond));
    add_value(row, worker.state());
    if (has_keys) {
      add_value(row, protocol::shortened(worker.key(), kKeyBytes));
    }
  }
  return table;
}

int workers(const WorkersFlags& flags) {
  const auto format = format_named(flags.format);
  if (flags.source.database.empty()) {
    const auto settings = connection_settings(flags.source);
    const auto reply = Connection(settings).workers();
    tell_if_insecure(reply.access(), settings.server_url);
    print_out(format == Format::kTable ? table_for_people(reply) : full_table(reply), format);
    std::cout.flush();  // where both are one terminal, what follows stands below the table
    tell_access(reply);
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
