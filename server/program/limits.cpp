#include "server/program/limits.h"

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"

namespace oblique::server {
namespace {

constexpr std::int64_t kMost = 1'000'000;                       ///< of things that are counted
constexpr std::int64_t kMostBytes = std::int64_t{1} << 40U;     ///< 1 TiB
constexpr std::int64_t kOneMessage = protocol::kMaxFrameBytes;  ///< bytes of the longest
constexpr std::int64_t kHour_ms = 3'600'000;
constexpr std::int64_t kMostPoints = std::int64_t{1} << 60U;

/// A check for whole numbers from `least` to `largest`.
CLI::Validator whole_number(std::int64_t least, std::int64_t largest) {
  return CLI::Validator(
      [least, largest](const std::string& text) {
        std::int64_t value = 0;
        const char* const last = text.data() + text.size();
        const auto [end, error] = std::from_chars(text.data(), last, value);
        return error == std::errc() && end == last && value >= least && value <= largest
                   ? std::string()
                   : fmt::format("{} is not allowed: it must be a whole number from {} to {}", text,
                                 least, largest);
      },
      "");
}

constexpr const char* kGroup = "Limits";

/// Says where the bounds are shown instead of listing them all; --help-all lists them.
class BriefHelp : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    CLI::Formatter whole;
    whole.column_width(get_column_width());
    return mode == CLI::AppFormatMode::All ? whole.make_help(app, name, mode)
                                           : CLI::Formatter::make_help(app, name, mode);
  }
  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override {
    return group == kGroup ? "\nLimits:\n  --limits-KEY, one for each bound that --print-config "
                             "and --help-all show\n"
                           : CLI::Formatter::make_group(group, is_positional, options);
  }
};

/// Makes options of bounds.
class Adder {
 public:
  explicit Adder(CLI::App& app) : app_(app) {}

  template <typename Number>
  void operator()(const char* key, Number& value, std::int64_t least, std::int64_t largest,
                  const char* meaning) {
    app_.add_option(fmt::format("--limits-{}", key), value, meaning)
        ->capture_default_str()
        ->check(whole_number(least, largest))
        ->group(kGroup);
  }

 private:
  CLI::App& app_;
};

}  // namespace

void add_limits(CLI::App& app, NetworkLimits& network, ServiceSettings& service,
                QueueSettings& queries) {
  const auto help = std::make_shared<BriefHelp>();
  help->column_width(app.get_formatter()->get_column_width());
  app.formatter(help);
  app.set_help_all_flag("--help-all", "Print the same with every bound, and exit");
  Adder add(app);
  // Connections.
  add("connections", network.connections, 2, kMost, "Connections at all ports");
  add("handshake-ms", network.handshake_ms, 10, kHour_ms, "For a peer to say who it is");
  add("active-ms", network.active_ms, 0, kHour_ms,
      "A connection heard so recently does not make room for another");
  add("held-in-bytes", network.held_in_bytes, kOneMessage, kMostBytes,
      "Messages of all peers that have not come whole or were not taken");
  add("held-in-bytes-to-pause", network.held_in_to_pause_bytes, kOneMessage, kMostBytes,
      "With so many of a port nobody of it is read until some were taken");
  add("busy-bytes", network.busy_bytes, 1, kMostBytes,
      "A peer with more waiting to go out to it is not heard");
  add("waiting-out-bytes", network.waiting_out_bytes, kOneMessage, kMostBytes,
      "What waits to go out to one peer");
  add("all-waiting-out-bytes", network.all_waiting_out_bytes, kOneMessage, kMostBytes,
      "What waits to go out to all peers");
  add("handshakes", network.handshakes, 1, kMost, "Connections that have not said who they are");
  // Results on their way to the disk.
  add("unstored-bytes", service.ledger.bytes, 1, kMostBytes, "Results that wait for the disk");
  // Requests of clients.
  add("running-queries", queries.readers, 1, 256, "Queries that run side by side");
  add("running-queries-of-client", queries.most_running_each, 1, 256,
      "Queries of one client that run side by side");
  add("waiting-queries", queries.most_waiting, 1, kMost, "Queries that wait");
  add("waiting-queries-of-client", queries.most_waiting_each, 1, kMost,
      "Queries of one client that wait");
  add("waiting-query-bytes", queries.most_waiting_bytes, 1, kMostBytes,
      "Statements of queries that wait");
  // Studies.
  add("open-studies", service.bounds.studies, 1, kMostBytes, "Studies neither done nor cancelled");
  add("open-points", service.bounds.points, 1, kMostPoints, "Points of these studies");
  // Workers.
  add("credit", service.scheduler.max_credit, 1, 65'536, "Batches that a worker may ask for");
}

}  // namespace oblique::server
