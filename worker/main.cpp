#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include "proto/frames.h"
#include "proto/program/configuration.h"
#include "proto/program/log.h"
#include "proto/program/origin/origin.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"
#include "proto/system/available_memory.h"
#include "worker/session.h"
#include "worker/solver/fall_cache.h"
#include "worker/solver/model/fall_model.h"
#include "worker/solver/point_runs.h"
#include "worker/solver/solve.h"
#include "worker/trace_solver.h"

namespace {

using oblique::protocol::Configuration;
using oblique::protocol::LogSettings;
using oblique::worker::SessionSettings;

constexpr const char* kProgram = "oblique-worker";

std::string host_name() {
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  return host.data();
}

/// Empty for a name that any terminal shows and any message carries, else what is wrong with it.
std::string objection_to_name(const std::string& name) {
  constexpr std::size_t kLongestName = 200;
  const bool is_plain =
      std::all_of(name.begin(), name.end(), [](char c) { return c >= ' ' && c <= '~'; });
  return is_plain && !name.empty() && name.size() <= kLongestName
             ? ""
             : "a name has 1 to 200 printable ASCII characters";
}

constexpr std::size_t kMostThreads = 4096;

std::size_t cores() {
  return std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMostThreads);
}

/// The time from now to `text`, negative for the past: a time in UTC, as 2026-11-22T05:00:00Z, or a
/// duration, as 90m. Nothing for other text.
std::optional<std::chrono::milliseconds> time_until(const std::string& text) {
  using std::chrono::milliseconds;
  std::tm parts{};
  const char* const end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  if (end != nullptr && *end == '\0') {
    const int day = parts.tm_mday;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const milliseconds left =
        std::chrono::floor<milliseconds>(std::chrono::seconds(timegm(&parts)) - now);
    // A day that the month does not have has become one of the next month.
    return parts.tm_mday == day ? std::optional(left) : std::nullopt;
  }
  constexpr double kLongest_s = 1e9;
  constexpr std::array kUnits_s{1.0, 60.0, 3600.0};
  const std::size_t unit = std::string_view("smh").find(text.empty() ? ' ' : text.back());
  double value = 0.0;
  if (unit >= kUnits_s.size() ||
      !CLI::detail::lexical_cast(text.substr(0, text.size() - 1), value) || !(value >= 0.0) ||
      value * kUnits_s[unit] > kLongest_s) {
    return std::nullopt;
  }
  return milliseconds(std::llround(value * kUnits_s[unit] * 1000.0));
}

/// Empty for a time or duration, else what is wrong with it.
std::string objection_to_until(const std::string& text) {
  return time_until(text)
             ? ""
             : "\"" + text +
                   "\" is neither a time, as 2026-11-22T05:00:00Z, nor a duration, as 90m";
}

/// Fills in the settings that follow from `--until` and `--idle-exit`. Returns what is wrong where
/// the worker would have to leave before it works; else an empty text.
std::string set_exit(oblique::worker::ExitSettings& exit, double idle_exit_s) {
  using std::chrono::duration_cast;
  using std::chrono::milliseconds;
  if (idle_exit_s > 0.0) {
    exit.idle_exit_ms = std::max<std::int64_t>(std::llround(idle_exit_s * 1000.0), 1);
  }
  const auto left = time_until(exit.until);
  if (!left) {
    return {};
  }
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  exit.until_ms = (duration_cast<milliseconds>(now) + *left).count();
  if (left->count() < 0) {
    return fmt::format("--until {} is in the past", exit.until);
  }
  constexpr std::int64_t kSecond_ms = 1000;
  return left->count() > exit.shutdown_grace_ms
             ? ""
             : fmt::format("--until {} leaves no time to work: leaving begins {} s before it",
                           exit.until, exit.shutdown_grace_ms / kSecond_ms);
}

int run_worker(SessionSettings settings, std::uint64_t fall_memory_bytes, pid_t parent) {
  oblique::protocol::Notifier notifier;
  oblique::protocol::StopSignals stop;  // before any thread starts
  oblique::protocol::survive_failed_writes();
  if (!oblique::protocol::stop_with_parent(parent)) {
    spdlog::warn("the parent process ended before this one started");
    return oblique::protocol::kDone;
  }
  if (fall_memory_bytes == 0) {
    fall_memory_bytes =
        oblique::protocol::available_memory_bytes() / oblique::solver::kFallsPartOfMemory;
  }
  oblique::solver::FallCache falls(fall_memory_bytes);
  const oblique::worker::Session* running = nullptr;
  settings.on_turn = [&] {
    notifier.status(running->status());
    notifier.feed_watchdog(oblique::protocol::Notifier::Clock::now());
  };
  oblique::worker::Session session(
      settings,
      [&](const auto& batch, auto& points, const auto& take) {
        oblique::solver::solve_points_of_models(points, falls, batch.points().wants_errors(), take);
      },
      [&](const auto& order, const auto& sink) {
        return oblique::worker::solve_trace(order, sink, falls);
      });
  spdlog::info("worker {}, solver {} ({}), threads {}, server {}", settings.name,
               oblique::solver::solver_version(), oblique::solver::instruction_set(),
               settings.threads, settings.server);
  running = &session;
  notifier.ready("looks for the server");  // which may come later
  const int exit_code = session.run(stop.descriptor(), [&] {
    stop.requested();
    constexpr std::chrono::seconds kLongestEnd{5};
    notifier.stopping("stopping", kLongestEnd);
  });
  if (session.is_solving()) {
    // Points cannot be interrupted and may take long; nobody waits for them any more.
    spdlog::default_logger()->flush();
    std::_Exit(exit_code);
  }
  return exit_code;
}

void add_options(CLI::App& app, Configuration& configuration, pid_t& parent,
                 SessionSettings& settings, std::uint64_t& fall_memory_bytes, double& idle_exit_s,
                 std::string& keys, LogSettings& log) {
  app.set_version_flag("--version", "oblique-worker " + oblique::protocol::version_and_commit());
  app.add_option("--server", settings.server, "Where the server awaits workers")
      ->type_name("URL")
      ->capture_default_str();
  app.add_option("--keys", keys, "Key file for a server that has keys")
      ->type_name("FILE")
      ->envname("OBLIQUE_KEYS");
  app.add_option("--name", settings.name, "Name that people see; the default is HOST:PROCESS")
      ->type_name("NAME")
      ->check(objection_to_name);
  app.add_option("--threads", settings.threads,
                 "Points solved at a time, each thread on a core; the default is all cores here")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, kMostThreads));
  app.add_option(
         "--fall-memory", fall_memory_bytes,
         "Memory for solved falls, as 2GB: points that share a fall need not solve it again; "
         "the default is an eighth of the free memory, or of the container's limit")
      ->type_name("SIZE")
      ->transform(CLI::AsSizeValue(false).description(""));
  app.add_option("--until", settings.conversation.exit.until,
                 "Be gone by then: a time in UTC, as 2026-11-22T05:00:00Z, "
                 "or a duration from now, as 90m")
      ->type_name("TIME")
      ->check(objection_to_until);
  constexpr double kLongestIdle_s = 1e9;
  app.add_option("--idle-exit", idle_exit_s, "Leave after so many seconds without work; 0: stay")
      ->type_name("SECONDS")
      ->capture_default_str()
      ->check(oblique::protocol::number_between(0.0, kLongestIdle_s));
  oblique::protocol::add_stop_with_parent(app, parent);
  configuration.add_log_options(log);
}

/// Everything but errors that nobody foresaw.
int run_program(int argc, char** argv) {
  oblique::protocol::set_up_log(kProgram);
  oblique::protocol::silence_protobuf();
  SessionSettings settings;
  LogSettings log;
  std::string keys;
  settings.threads = cores();
  CLI::App app(
      "Solves points of parameter studies for an oblique-server.\n"
      "Example: oblique-worker --server tcp://127.0.0.1:7601",
      kProgram);
  Configuration configuration(app, "OBLIQUE_WORKER_", "worker.toml");
  pid_t parent = 0;
  double idle_exit_s = 0.0;
  std::uint64_t fall_memory_bytes = 0;
  add_options(app, configuration, parent, settings, fall_memory_bytes, idle_exit_s, keys, log);
  if (const auto exit_code = oblique::protocol::print_completion(app, argc, argv)) {
    return *exit_code;
  }
  if (const auto exit_code = configuration.parse(argc, argv)) {
    return *exit_code;
  }
  if (configuration.is_to_be_printed()) {
    std::cout << configuration.printed();
    return oblique::protocol::kDone;
  }
  if (const std::string objection = set_exit(settings.conversation.exit, idle_exit_s);
      !objection.empty()) {
    return oblique::protocol::report_wrong_usage(app.get_name(), objection);
  }
  settings.host = host_name();
  if (settings.name.empty()) {
    settings.name = settings.host + ":" + std::to_string(getpid());
  }
  oblique::protocol::set_up_log(kProgram, log);
  try {
    if (!keys.empty()) {
      settings.key = oblique::protocol::read_key_file(keys);
    }
    return run_worker(settings, fall_memory_bytes, parent);
  } catch (const oblique::solver::InputError& error) {
    return oblique::protocol::report_wrong_usage(app.get_name(), error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run_program(argc, argv);
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return oblique::protocol::kFailed;
  }
}
