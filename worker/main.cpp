#include <pthread.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <thread>

#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include "proto/frames.h"
#include "proto/program/log.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "worker/point_solver.h"
#include "worker/session.h"
#include "worker/solver/solve.h"

namespace {

using oblique::worker::SessionSettings;

std::string host_and_process() {
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  return std::string(host.data()) + ":" + std::to_string(getpid());
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

/// Empty for the id of a process, and for no value at all.
std::string objection_to_process(const std::string& text) {
  pid_t process = 0;
  return text.empty() || (CLI::detail::lexical_cast(text, process) && process > 0)
             ? ""
             : "\"" + text + "\" is no process id";
}

constexpr std::size_t kMostThreads = 4096;

std::size_t cores() {
  return std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMostThreads);
}

/// Blocks SIGTERM and SIGINT for this thread and those it starts, and returns a descriptor that is
/// readable when one has come.
int signal_descriptor() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC);
}

/// `parent` is who started this process, 0 when nobody has said.
int run_worker(const SessionSettings& settings, pid_t parent) {
  const int signals = signal_descriptor();
  // The log's reader may be gone before this process is.
  std::signal(SIGPIPE, SIG_IGN);
  oblique::worker::PointSolver points(settings.models_kept);
  oblique::worker::Session session(settings,
                                   [&](const auto& batch, const auto& next, const auto& take) {
                                     points.solve(batch, next, take);
                                   });
  // The session waits for the end of whoever was the parent when it was made. One that was gone by
  // then must have been named to be missed.
  if (parent != 0 && getppid() != parent) {
    spdlog::warn("the parent process was gone before this one began");
    return EXIT_SUCCESS;
  }
  spdlog::info("worker {}, solver {} ({}), threads {}, server {}", settings.name,
               oblique::solver::solver_version(), oblique::solver::instruction_set(),
               settings.threads, settings.server);
  const int exit_code = session.run(signals, [&] {
    signalfd_siginfo received{};
    static_cast<void>(read(signals, &received, sizeof(received)));
  });
  if (session.is_solving()) {
    // Points cannot be interrupted and may take long; nobody waits for them any more.
    spdlog::default_logger()->flush();
    std::_Exit(exit_code);
  }
  return exit_code;
}

/// Everything but errors that nobody foresaw.
int run_program(int argc, char** argv) {
  oblique::protocol::set_up_log("oblique-worker");
  oblique::protocol::silence_protobuf();
  SessionSettings settings;
  settings.name = host_and_process();
  settings.threads = cores();
  bool quiet = false;
  CLI::App app(
      "Solves points of parameter studies for an oblique-server.\n"
      "Example: oblique-worker --server tcp://127.0.0.1:7601",
      "oblique-worker");
  app.set_version_flag("--version", "oblique-worker " + oblique::solver::solver_version());
  app.add_option("--server", settings.server, "Where the server awaits workers")
      ->capture_default_str();
  app.add_option("--name", settings.name, "Name that people see")
      ->capture_default_str()
      ->check(objection_to_name);
  app.add_option("--threads", settings.threads,
                 "Points solved at a time, each thread on a core; the default is all cores here")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, kMostThreads));
  pid_t parent = 0;
  auto* with_parent =
      app.add_option("--stop-with-parent", parent,
                     "Stop when the parent process is gone; with its id, also when it was before "
                     "this one began")
          ->expected(0, 1)
          ->check(objection_to_process)
          ->type_name("[PID]");
  app.add_flag("--quiet", quiet, "Log warnings and errors only");
  if (const auto exit_code = oblique::protocol::parse_command_line(app, argc, argv)) {
    return *exit_code;
  }
  settings.stop_with_parent = with_parent->count() > 0;
  if (quiet) {
    spdlog::set_level(spdlog::level::warn);
  }
  try {
    return run_worker(settings, parent);
  } catch (const oblique::worker::AddressError& error) {
    return oblique::protocol::tell_wrong_usage(app.get_name(), error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run_program(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "oblique-worker: " << oblique::protocol::visible_lines(error.what()) << '\n';
    return EXIT_FAILURE;
  }
}
