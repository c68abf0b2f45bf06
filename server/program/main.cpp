// The program oblique-server: command line, signals and exit codes around the event loop.
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "proto/frames.h"
#include "proto/program/configuration.h"
#include "proto/program/log.h"
#include "proto/program/origin/origin.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"
#include "server/event_loop/event_loop.h"
#include "server/query/query_pool.h"
#include "server/web/web.h"
#include "worker/solver/model/parameters.h"

namespace {

using oblique::protocol::Configuration;
using oblique::protocol::Notifier;
using oblique::server::EventLoop;
using oblique::server::LoopSettings;
using oblique::server::LoopState;

constexpr const char* kProgram = "oblique-server";
/// Maximum time of the last commit, which may take long on a slow disk.
constexpr std::chrono::seconds kLongestEnd{60};

struct Options {
  LoopSettings loop;
  std::uint16_t worker_port = 7601;
  std::uint16_t client_port = 7600;
  oblique::server::HttpOptions http;
  int ready_fd = -1;
  double drain_s = 5.0;
  bool is_of_file = false;  ///< of the page
  oblique::protocol::LogSettings log;
};

/// Returns "" if the text is -1 or an open descriptor, else an error message.
std::string descriptor_error(const std::string& text) {
  int fd = -1;
  const bool is_number = CLI::detail::lexical_cast(text, fd);
  return is_number && (fd == -1 || fcntl(fd, F_GETFD) != -1)
             ? ""
             : "\"" + text + "\" is not an open file descriptor";
}

/// Writes a line of JSON to the descriptor given by --ready-fd, if there is one.
void write_line(int fd, const nlohmann::json& object) {
  const std::string line = object.dump(-1, ' ', true) + "\n";
  if (fd >= 0 && ::write(fd, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw std::runtime_error("cannot write to the file descriptor of --ready-fd: " +
                             std::string(std::strerror(errno)));
  }
}

void write_endpoints(int fd, const EventLoop& loop) {
  nlohmann::json endpoints{{"client", loop.client_endpoint()}, {"worker", loop.worker_endpoint()}};
  if (!loop.http_url().empty()) {
    endpoints["http"] = loop.http_url();
    endpoints["page"] = loop.page_url();
  }
  write_line(fd, endpoints);
  ::close(fd);
}

/// Opens the database and the ports. While another program has locked the database, reports that
/// once and tries again. Returns null when a signal arrives meanwhile.
std::unique_ptr<EventLoop> open_loop(const LoopSettings& settings, int ready_fd,
                                     oblique::protocol::StopSignals& stop) {
  constexpr std::chrono::milliseconds kPause{500};
  for (bool is_reported = false; !stop.wait(std::chrono::milliseconds(0));) {
    try {
      return std::make_unique<EventLoop>(settings);
    } catch (const oblique::server::StorageBusy&) {
      const std::string reason = fmt::format(
          "another program has locked the database {}: waiting until it ends", settings.database);
      if (!std::exchange(is_reported, true)) {
        spdlog::warn("{}", reason);
        write_line(ready_fd, {{"waits_for", reason}});
      }
      stop.wait(kPause);
    }
  }
  return nullptr;
}

/// Reports the state of the loop to the service manager.
void notify(Notifier& notifier, const LoopState& state, std::chrono::milliseconds drain) {
  switch (state.stage) {
    case LoopState::Stage::kRuns:
      notifier.status(fmt::format("{} workers", state.workers));
      break;
    case LoopState::Stage::kDrains:
      notifier.stopping(fmt::format("draining: waiting for {} batches of workers", state.leases),
                        drain + kLongestEnd);
      break;
    case LoopState::Stage::kEnds:
      notifier.stopping("stopping", kLongestEnd);
      break;
  }
  notifier.feed_watchdog(Notifier::Clock::now());
}

int run(LoopSettings settings, int ready_fd, pid_t parent) {
  Notifier notifier;
  oblique::protocol::StopSignals stop;  // must be created before any thread starts
  std::signal(SIGPIPE, SIG_IGN);        // makes writes to closed pipes return an error
  if (!oblique::protocol::stop_with_parent(parent)) {
    spdlog::warn("the parent process ended before this one started");
    return oblique::protocol::kDone;
  }
  settings.on_turn = [&notifier, drain = settings.drain](const LoopState& state) {
    notify(notifier, state, drain);
  };
  const auto opened = open_loop(settings, ready_fd, stop);
  if (opened == nullptr) {
    return oblique::protocol::kDone;
  }
  EventLoop& loop = *opened;
  spdlog::info("database {}, clients at {}, workers at {}, metrics at {}", settings.database,
               loop.client_endpoint(), loop.worker_endpoint(),
               loop.http_url().empty() ? "no address" : loop.http_url() + "/metrics");
  if (ready_fd >= 0) {
    write_endpoints(ready_fd, loop);
  }
  if (!loop.page_url().empty() && ::isatty(STDERR_FILENO) == 1) {
    // The URL is not logged, because whoever reads it can change studies.
    std::cerr << "The page of this server: " << loop.page_url() << "\n";
  }
  notifier.ready(fmt::format("clients at {}", loop.client_endpoint()));
  const auto end = loop.run(stop.descriptor(), [&stop] { stop.requested(); });
  return end.lost_writes == 0 && !end.lost_database ? oblique::protocol::kDone
                                                    : oblique::protocol::kFailed;
}

/// Adds options for the limits that users may set. server/study/limits.h has all limits.
void add_limits(CLI::App& app, LoopSettings& loop) {
  constexpr std::size_t kMax = 1'000'000;  // largest value of an option that is a count
  constexpr std::size_t kLongestMessage = oblique::protocol::kMaxFrameBytes;
  constexpr std::size_t kMaxBytes = std::size_t{1} << 40U;
  const auto add = [&app](const char* name, auto& value, auto least, auto largest,
                          const char* meaning) {
    using Number = std::decay_t<decltype(value)>;
    app.add_option(name, value, meaning)
        ->check(CLI::Range(static_cast<Number>(least), static_cast<Number>(largest)))
        ->group("Limits");
  };
  add("--limits-connections", loop.network.connections, 2U, kMax,
      "Maximum number of connections at both ports");
  add("--limits-waiting-out-bytes", loop.network.waiting_out_bytes, kLongestMessage, kMaxBytes,
      "End a connection with more unsent bytes than this");
  add("--limits-unstored-bytes", loop.service.ledger.bytes, 1U, kMaxBytes,
      "Stop reading from workers while more than this many bytes of results are unstored");
  add("--limits-running-queries", loop.queries.queue.readers, 1U, 256U,
      "Maximum number of queries that run at a time, each in its own process");
  constexpr std::uint64_t kMaxPoints = std::uint64_t{1} << 60U;
  add("--limits-open-points", loop.service.bounds.points, 1U, kMaxPoints,
      "Maximum number of points of all studies that are neither done nor cancelled");
  add("--limits-credit", loop.service.scheduler.max_credit, 1U, 65'536U,
      "Maximum number of batches that a worker may request at a time");
}

void add_options(CLI::App& app, Configuration& configuration, pid_t& parent, Options& options) {
  LoopSettings& loop = options.loop;
  app.set_version_flag("--version", "oblique-server " + oblique::protocol::version_and_commit());
  app.option_defaults()->always_capture_default();
  app.add_option("--db", loop.database, "Database file; created if it does not exist")
      ->type_name("FILE");
  app.add_flag("--allow-network-disk", loop.allow_network_disk,
               "Allow a database on a network file system, where a second machine could damage it");
  app.add_option(
         "--listen", loop.access.listen,
         "Address to listen on, * for all; addresses other than loopback need --keys or --insecure")
      ->type_name("ADDRESS");
  app.add_option("--keys", loop.access.keys,
                 "Key file of the server, from `oblique keygen`; the list of admitted keys, "
                 "authorized_keys.toml, must be in the same folder")
      ->type_name("FILE")
      ->envname("OBLIQUE_KEYS");
  app.add_flag("--insecure", loop.access.insecure,
               "Admit every peer that reaches the ports, unencrypted");
  constexpr double kLargestPort = 65535;
  const CLI::Validator port = oblique::protocol::number_between(0, kLargestPort);
  app.add_option("--worker-port", options.worker_port, "Port for workers; 0: chosen by the system")
      ->check(port);
  app.add_option("--client-port", options.client_port, "Port for clients; 0: chosen by the system")
      ->check(port);
  app.add_option("--ready-fd", options.ready_fd,
                 "File descriptor to which the server writes one line of JSON with both endpoints "
                 "when it is ready, and before that a line with waits_for; -1: none")
      ->check(descriptor_error)
      ->configurable(false);
  options.http.add_to(app);
  app.add_option("--only-study", loop.service.only_study,
                 "Send batches of this study only; other studies wait")
      ->type_name("NAME")
      ->configurable(false);
  constexpr double kLongestDrain_s = 1e6;
  app.add_option("--drain", options.drain_s,
                 "Time to wait for running batches on shutdown; 0: stop at once")
      ->type_name("SECONDS")
      ->check(oblique::protocol::number_between(0.0, kLongestDrain_s));
  oblique::protocol::add_stop_with_parent(app, parent);
  app.add_flag("--page-of-file", options.is_of_file, "Show the name of the database on the page")
      ->configurable(false);
  configuration.add_log_options(options.log);
  add_limits(app, loop);
}

/// Completes the options. Returns the exit code if the server must not run: after an error, which
/// it prints, or for --print-config.
std::optional<int> finish_options(const CLI::App& app, const Configuration& configuration,
                                  Options& options) {
  LoopSettings& loop = options.loop;
  try {
    if (options.worker_port == options.client_port && options.worker_port != 0) {
      throw std::runtime_error("--worker-port and --client-port are both " +
                               std::to_string(options.worker_port) + ": they must differ");
    }
    (void)oblique::server::address_to_bind(loop.access);
    loop.web = options.http.settings();
  } catch (const std::runtime_error& error) {
    return oblique::protocol::report_wrong_usage(app.get_name(), error.what());
  }
  if (configuration.is_to_be_printed()) {
    std::cout << configuration.printed();
    return oblique::protocol::end_output(std::cout, app.get_name(), oblique::protocol::kDone);
  }
  loop.worker_port = options.worker_port == 0 ? "*" : std::to_string(options.worker_port);
  loop.client_port = options.client_port == 0 ? "*" : std::to_string(options.client_port);
  constexpr double kMillisecondsASecond = 1000.0;
  loop.drain = std::chrono::milliseconds(std::llround(options.drain_s * kMillisecondsASecond));
  loop.service.solver_version = oblique::solver::solver_version();
  loop.service.clients.version = oblique::protocol::version_and_commit();
  return std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  oblique::protocol::prepare_process(RLIM_INFINITY);  // each connection needs a file
  if (argc == 3 && std::string_view(argv[1]) == oblique::server::kReadMode) {
    return oblique::server::run_reader_program(argv[2]);
  }
  pid_t parent = 0;
  oblique::protocol::silence_protobuf();
  oblique::protocol::set_up_log(kProgram);
  CLI::App app{
      "Distributes the points of studies to workers and stores the results.\n"
      "Example: oblique-server --db oblique.db",
      kProgram};
  Options options;
  options.loop.database = "oblique.db";
  Configuration configuration(app, "OBLIQUE_SERVER_", "server.toml");
  try {
    add_options(app, configuration, parent, options);
    if (const auto exit_code = oblique::protocol::print_completion(app, argc, argv)) {
      return *exit_code;
    }
    if (const auto exit_code = configuration.parse(argc, argv)) {
      return *exit_code;
    }
    if (const auto exit_code = finish_options(app, configuration, options)) {
      return *exit_code;
    }
    if (options.loop.web) {
      options.loop.web->page.is_of_file = options.is_of_file;
    }
    oblique::protocol::set_up_log(kProgram, options.log);
    return run(options.loop, options.ready_fd, parent);
  } catch (const std::exception& error) {
    spdlog::error("{}", oblique::protocol::failure_text(error));
    return oblique::protocol::kFailed;
  }
}
