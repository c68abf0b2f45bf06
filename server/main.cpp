// oblique-server: command line, signals and exit codes around the loop.
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <unistd.h>
#include <csignal>

#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "proto/frames.h"
#include "proto/program/log.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "server/loop.h"
#include "server/queries/reader_program.h"
#include "worker/solver/model/version.h"

namespace {

using oblique::server::Loop;
using oblique::server::LoopSettings;

constexpr int kFailed = 1;

/// SIGINT and SIGTERM as a readable file descriptor. Must run before any thread starts, so that all
/// inherit the mask.
int stop_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  if (pthread_sigmask(SIG_BLOCK, &signals, nullptr) != 0) {
    throw std::runtime_error("cannot block signals");
  }
  const int fd = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
  if (fd < 0) {
    throw std::runtime_error(std::string("cannot watch for signals: ") + std::strerror(errno));
  }
  return fd;
}

/// Asks the system for SIGTERM when the parent ends; a parent that ended before is noticed too.
void stop_with_parent(pid_t parent) {
  if (prctl(PR_SET_PDEATHSIG, SIGTERM) != 0) {
    throw std::runtime_error(std::string("cannot watch the parent process: ") +
                             std::strerror(errno));
  }
  if (getppid() != parent) {
    throw std::runtime_error("the parent process has ended");
  }
}

/// A connection takes a descriptor, and systems give few to begin with.
void take_all_descriptors() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    limit.rlim_cur = limit.rlim_max;
    // Otherwise there are fewer connections.
    static_cast<void>(setrlimit(RLIMIT_NOFILE, &limit));
  }
}

/// Empty for −1 and for a descriptor that is open, else what is wrong with it.
std::string objection_to_descriptor(const std::string& text) {
  int fd = -1;
  const bool is_number = CLI::detail::lexical_cast(text, fd);
  return is_number && (fd == -1 || fcntl(fd, F_GETFD) != -1)
             ? ""
             : "\"" + text + "\" is no open file descriptor";
}

void tell_ready(int fd, const Loop& loop) {
  const std::string line =
      nlohmann::json{{"client", loop.client_endpoint()}, {"worker", loop.worker_endpoint()}}
          .dump() +
      "\n";
  if (::write(fd, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw std::runtime_error("cannot write to the file descriptor of --ready-fd: " +
                             std::string(std::strerror(errno)));
  }
  ::close(fd);
}

int run(const LoopSettings& settings, int ready_fd) {
  const int stop_fd = stop_signals();
  // A file that may not grow further is a full disk, and no reason to die.
  std::signal(SIGXFSZ, SIG_IGN);
  take_all_descriptors();
  Loop loop(settings);
  spdlog::info("database {}, clients at {}, workers at {}", settings.database,
               loop.client_endpoint(), loop.worker_endpoint());
  if (ready_fd >= 0) {
    tell_ready(ready_fd, loop);
  }
  const auto end = loop.run(stop_fd);
  return end.lost_writes == 0 && !end.lost_database ? 0 : kFailed;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::string_view(argv[1]) == oblique::server::kReadMode) {
    return oblique::server::run_reader_program(argv[2]);
  }
  const pid_t parent = getppid();
  oblique::protocol::silence_protobuf();
  oblique::protocol::set_up_log("oblique-server");

  LoopSettings settings;
  settings.database = "oblique.db";
  std::uint16_t worker_port = 7601;
  std::uint16_t client_port = 7600;
  int ready_fd = -1;
  bool with_parent = false;
  bool quiet = false;
  CLI::App app{
      "Hands out the points of studies to workers and keeps the results.\n"
      "Example: oblique-server --db oblique.db",
      "oblique-server"};
  app.set_version_flag("--version", "oblique-server " + oblique::solver::solver_version());
  app.option_defaults()->always_capture_default();
  app.add_option("--db", settings.database, "Database file; made when it is not there");
  app.add_flag("--allow-network-disk", settings.allow_network_disk,
               "Take a database on a network file system, where a second machine could damage it");
  app.add_option("--listen", settings.listen, "Loopback address to listen on");
  app.add_option("--worker-port", worker_port, "Port for workers; 0: the system picks one");
  app.add_option("--client-port", client_port, "Port for clients; 0: the system picks one");
  app.add_option("--ready-fd", ready_fd,
                 "File descriptor that gets one line of JSON with both endpoints once the server "
                 "can be used; -1: none")
      ->check(objection_to_descriptor);
  app.add_flag("--stop-with-parent", with_parent, "Stop when the process that started this ends");
  app.add_flag("--quiet", quiet, "Log warnings and errors only");
  if (const auto exit_code = oblique::protocol::parse_command_line(app, argc, argv)) {
    return *exit_code;
  }
  try {
    if (worker_port == client_port && worker_port != 0) {
      throw std::runtime_error("--worker-port and --client-port are both " +
                               std::to_string(worker_port) + ": they must differ");
    }
    (void)oblique::server::loopback_address(settings.listen);
  } catch (const std::runtime_error& error) {
    return oblique::protocol::tell_wrong_usage(app.get_name(), error.what());
  }
  if (quiet) {
    spdlog::set_level(spdlog::level::warn);
  }
  settings.worker_port = worker_port == 0 ? "*" : std::to_string(worker_port);
  settings.client_port = client_port == 0 ? "*" : std::to_string(client_port);
  settings.service.solver_version = oblique::solver::solver_version();
  try {
    if (with_parent) {
      stop_with_parent(parent);
    }
    return run(settings, ready_fd);
  } catch (const std::exception& error) {
    std::cerr << "oblique-server: " << oblique::protocol::visible_lines(error.what()) << '\n';
    return kFailed;
  }
}
