#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include "proto/address.h"
#include "proto/frames.h"
#include "proto/program/configuration.h"
#include "proto/program/log.h"
#include "proto/program/origin/origin.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"
#include "proto/system/resources.h"
#include "worker/session.h"
#include "worker/solver/fall_cache.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/point_runs.h"
#include "worker/solver/solve.h"
#include "worker/supervisor.h"
#include "worker/trace_solver.h"

namespace {

using oblique::worker::SessionSettings;

constexpr const char* kProgram = "oblique-worker";
constexpr std::size_t kMaxThreads = 4096;
constexpr double kLongest_s = 1e9;

struct Options {
  SessionSettings session;
  oblique::protocol::LogSettings log;
  std::string keys;
  std::uint64_t fall_memory_bytes = 0;  ///< 0 means an eighth of the free memory
  double idle_exit_s = 0.0;
  pid_t parent = 0;
};

std::string host_name() {
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  return host.data();
}

/// Returns an error message if `name` cannot be shown or is too long; else an empty text.
std::string check_name(const std::string& name) {
  constexpr std::size_t kLongestName = 200;
  const bool is_plain =
      std::all_of(name.begin(), name.end(), [](char c) { return c >= ' ' && c <= '~'; });
  return is_plain && !name.empty() && name.size() <= kLongestName
             ? ""
             : "a name has 1 to 200 printable ASCII characters";
}

/// Returns the seconds from now to `text`, negative for the past. `text` is a time in UTC such as
/// 2026-11-22T05:00:00Z or a duration such as 90m, and must not be empty. Returns nothing for other
/// text.
std::optional<double> seconds_until(const std::string& text) {
  std::tm parts{};
  const char* const end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  if (end != nullptr && *end == '\0') {
    const int day = parts.tm_mday;
    const std::chrono::duration<double> left =
        std::chrono::system_clock::from_time_t(timegm(&parts)) - std::chrono::system_clock::now();
    // timegm turns February 30 into a day of March.
    return parts.tm_mday == day ? std::optional(left.count()) : std::nullopt;
  }
  constexpr std::array kUnits_s{1.0, 60.0, 3600.0};
  const std::size_t unit = std::string_view("smh").find(text.back());
  const auto value = oblique::solver::number_of(std::string_view(text).substr(0, text.size() - 1));
  if (unit >= kUnits_s.size() || !value || !(*value >= 0.0) ||
      *value * kUnits_s[unit] > kLongest_s) {
    return std::nullopt;
  }
  return *value * kUnits_s[unit];
}

/// Sets the times at which the worker stops: 3 s before the end that the user gave, or when idle.
/// Returns an error message, or an empty text.
std::string set_exit(oblique::worker::ExitSettings& exit, double idle_exit_s) {
  constexpr double kSecond_ms = 1000.0;
  constexpr double kTimeToStop_s = 3.0;
  if (idle_exit_s > 0.0) {
    exit.idle_exit_ms = std::max<std::int64_t>(std::llround(idle_exit_s * kSecond_ms), 1);
  }
  if (exit.until.empty()) {
    return {};
  }
  const double left_s = seconds_until(exit.until).value_or(0.0) - kTimeToStop_s;
  exit.stop_ms =
      std::chrono::steady_clock::now().time_since_epoch() / std::chrono::milliseconds(1) +
      std::llround(left_s * kSecond_ms);
  return left_s > 0.0 ? ""
                      : fmt::format(
                            "--until \"{}\" must be a time in UTC, as 2026-11-22T05:00:00Z, or a "
                            "duration, as 90m, more than {} s from now",
                            exit.until, kTimeToStop_s);
}

/// Solves until the worker is stopped. Runs in the child of the process that the user started.
int run_worker(SessionSettings& settings, std::uint64_t fall_memory_bytes,
               oblique::protocol::StopSignals& stop, int forwarder) {
  oblique::protocol::Notifier notifier(forwarder);
  oblique::solver::FallCache falls(fall_memory_bytes != 0
                                       ? fall_memory_bytes
                                       : oblique::protocol::available_memory_bytes() /
                                             oblique::solver::kFallsPartOfMemory);
  const oblique::protocol::AddressLookup address(settings.server);
  bool has_warned = false;
  settings.on_turn = [&](const std::string& status) {
    const std::string error = address.error();
    if (!error.empty() && !std::exchange(has_warned, true)) {
      spdlog::warn("{}: check --server; trying again", error);
    }
    notifier.status(status);
    notifier.feed_watchdog(oblique::protocol::Notifier::Clock::now());
  };
  oblique::worker::Session session(
      settings,
      [&](const auto& batch, auto& points, const auto& take) {
        oblique::solver::solve_points_of_models(points, falls, batch.points().wants_errors(), take);
      },
      [&](const auto& order, const auto& sink) {
        settings.slots.front().begin(0);
        auto result = oblique::worker::solve_trace(order, sink, falls);
        settings.slots.front().end(0);
        return result;
      });
  spdlog::info("worker {}, solver {} ({}), threads {}, server {}", settings.name,
               oblique::solver::solver_version(), oblique::solver::instruction_set(),
               settings.threads, settings.server);
  notifier.ready("connecting to the server");
  const int exit_code = session.run(stop.descriptor(), [&] {
    stop.requested();
    constexpr std::chrono::seconds kLongestEnd{5};
    notifier.stopping("stopping", kLongestEnd);
  });
  if (session.ends_slowly()) {
    // Ends the process, because points and lookups of names cannot be interrupted.
    spdlog::default_logger()->flush();
    std::_Exit(exit_code);
  }
  return exit_code;
}

/// Runs the worker in a child process, which is replaced when it crashes.
int run_supervised(Options& options) {
  oblique::protocol::StopSignals stop;  // must be constructed before any thread starts
  std::signal(SIGPIPE, SIG_IGN);        // makes writes to closed pipes return an error
  if (!oblique::protocol::stop_with_parent(options.parent)) {
    spdlog::warn("the parent process ended before this one started");
    return oblique::protocol::kDone;
  }
  SessionSettings& settings = options.session;
  settings.slots = oblique::worker::make_shared_slots(settings.threads);
  return oblique::worker::supervise(stop, settings.slots, [&](const auto& hello, int forwarder) {
    settings.hello = hello;
    return run_worker(settings, options.fall_memory_bytes, stop, forwarder);
  });
}

void add_options(CLI::App& app, Options& options) {
  SessionSettings& session = options.session;
  app.set_version_flag("--version", "oblique-worker " + oblique::protocol::version_and_commit());
  app.add_option("--server", session.server, "Address of the server for workers")
      ->type_name("URL")
      ->capture_default_str();
  app.add_option("--keys", options.keys, "Key file for a server that has keys")
      ->type_name("FILE")
      ->envname("OBLIQUE_KEYS");
  app.add_option("--name", session.name, "Name of the worker in lists; the default is HOST:PROCESS")
      ->type_name("NAME")
      ->check(check_name);
  session.threads =
      std::min<std::size_t>(oblique::protocol::usable_processors().count, kMaxThreads);
  app.add_option("--threads", session.threads,
                 "Threads that solve points; the default is one for each processor that this "
                 "process may use")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, kMaxThreads));
  app.add_option(
         "--fall-memory", options.fall_memory_bytes,
         "Memory for solved falls, such as 2GB; the default is an eighth of the free memory, "
         "or of the container's limit")
      ->type_name("SIZE")
      ->transform(CLI::AsSizeValue(false).description(""));
  app.add_option("--until", session.conversation.exit.until,
                 "Exit before this time: in UTC, as 2026-11-22T05:00:00Z, or from now, as 90m")
      ->type_name("TIME");
  app.add_option("--idle-exit", options.idle_exit_s,
                 "Exit after this many seconds without work; 0: never")
      ->type_name("SECONDS")
      ->capture_default_str()
      ->check(oblique::protocol::number_between(0.0, kLongest_s));
  oblique::protocol::add_stop_with_parent(app, options.parent);
}

int run_program(int argc, char** argv) {
  oblique::protocol::set_up_log(kProgram);
  oblique::protocol::silence_protobuf();
  Options options;
  SessionSettings& session = options.session;
  CLI::App app(
      "Solves points of parameter studies for an oblique-server.\n"
      "Example: oblique-worker --server tcp://127.0.0.1:7601",
      kProgram);
  oblique::protocol::Configuration configuration(app, "OBLIQUE_WORKER_", "worker.toml");
  add_options(app, options);
  configuration.add_log_options(options.log);
  if (const auto exit_code = oblique::protocol::print_completion(app, argc, argv)) {
    return *exit_code;
  }
  if (const auto exit_code = configuration.parse(argc, argv)) {
    return *exit_code;
  }
  if (configuration.is_to_be_printed()) {
    std::cout << configuration.printed();
    return oblique::protocol::end_output(std::cout, app.get_name(), oblique::protocol::kDone);
  }
  if (const std::string error = set_exit(session.conversation.exit, options.idle_exit_s);
      !error.empty()) {
    return oblique::protocol::report_wrong_usage(app.get_name(), error);
  }
  session.host = host_name();
  if (session.name.empty()) {
    session.name = session.host + ":" + std::to_string(getpid());
  }
  oblique::protocol::set_up_log(kProgram, options.log);
  try {
    if (!options.keys.empty()) {
      session.key = oblique::protocol::read_key_file(options.keys);
    }
    return run_supervised(options);
  } catch (const oblique::solver::InputError& error) {
    return oblique::protocol::report_wrong_usage(app.get_name(), error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  oblique::protocol::prepare_process();
  try {
    return run_program(argc, argv);
  } catch (const std::exception& error) {
    spdlog::error("{}", oblique::protocol::failure_text(error));
    return oblique::protocol::kFailed;
  }
}
