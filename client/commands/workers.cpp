#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/io/console.h"
#include "client/io/row_output.h"
#include "client/service/connection.h"
#include "client/service/source.h"
#include "client/service/watching.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

constexpr const char* kWorkersExamples = R"(Examples:
  oblique workers
  oblique workers --server tcp://127.0.0.1:7600 --format csv
  oblique workers --db sweep.db        every worker that delivered a result

A server lists the workers that are connected now.)";

struct WorkersFlags {
  std::string format{"table"};
  SourceFlags source;
};

/// Returns the cause of a refusal in words. "other mechanism" means that the peer has no key, or
/// that only the peer has a key.
std::string shown_cause(const protocol::WorkersReply& reply, const std::string& reason) {
  const bool is_mechanism = reason == "other mechanism";
  return !is_mechanism              ? reason
         : reply.access() == "keys" ? "without a key"
                                    : "with a key, but the server has none";
}

/// Prints the numbers of refused peers and of malformed frames.
void note_access(Console& console, const protocol::WorkersReply& reply) {
  std::string refusals;
  for (const auto& of_cause : reply.refusals()) {
    if (of_cause.peers() > 0) {
      refusals += fmt::format("{} {} ({})", refusals.empty() ? "" : ",",
                              shown_cause(reply, of_cause.reason()), of_cause.peers());
    }
  }
  if (!refusals.empty()) {
    console.note("refused since the server started:" + refusals);
  }
  if (reply.bad_frames() > 0) {
    console.note(
        fmt::format("{} arrived; the server's log names the senders",
                    counted(reply.bad_frames(), "malformed message", "malformed messages")));
  }
}

/// Returns all columns, for programs.
protocol::Table full_table(const protocol::WorkersReply& reply) {
  protocol::Table table{.columns = {"worker", "name", "threads", "instruction_set",
                                    "solver_version", "leased_points", "solved_points", "silent_ms",
                                    "losses", "host", "points_per_s", "state", "key"}};
  const auto number = [](auto value) { return static_cast<std::int64_t>(value); };
  for (const auto& worker : reply.workers()) {
    table.rows.push_back({number(worker.worker_id()), worker.name(), number(worker.threads()),
                          worker.instruction_set(), worker.solver_version(),
                          number(worker.leased_points()), number(worker.solved_points()),
                          number(worker.silent_ms()), number(worker.losses()), worker.host(),
                          worker.points_per_s(), worker.state(), worker.key()});
  }
  return table;
}

/// Returns the main columns, in at most 100 characters. If a worker's name begins with its host,
/// the column `name` omits the host.
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
    auto& row = table.rows.emplace_back(protocol::Row{
        static_cast<std::int64_t>(worker.worker_id()),
        protocol::shortened(worker.host(), host_bytes), protocol::shortened(name, name_bytes),
        static_cast<std::int64_t>(worker.threads()), worker.instruction_set(),
        worker.solver_version(), format_rate(worker.points_per_s()),
        format_duration(worker.silent_ms() / kMillisecondsASecond), worker.state()});
    if (has_keys) {
      row.emplace_back(protocol::shortened(worker.key(), kKeyBytes));
    }
  }
  return table;
}

int workers(const WorkersFlags& flags, Console& console) {
  const auto format = format_named(flags.format);
  if (!flags.source.database.empty()) {
    print_out(open_database(flags.source.database)
                  ->query("SELECT worker_id AS worker, name, threads, instruction_set, "
                          "solver_version, joined_at FROM workers ORDER BY worker_id"),
              format);
    return kDone;
  }
  const auto settings = connection_settings(console, flags.source);
  const auto reply = Connection(settings).workers();
  warn_if_insecure(console, reply.access(), settings.server_url);
  print_out(format == Format::kTable ? table_for_people(reply) : full_table(reply), format);
  note_access(console, reply);
  return kDone;
}

}  // namespace

void add_workers(CLI::App& app, Action& parsed) {
  auto [command, flags] = new_command(app, parsed, "workers", "List the workers of a server",
                                      kWorkersExamples, workers);
  add_format_flag(command, flags.format);
  command.add_option("--db", flags.source.database, "database to read directly instead")
      ->type_name("FILE");
  add_server_flags(command, flags.source);
}

}  // namespace oblique::client
