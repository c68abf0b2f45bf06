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
#include <sys/resource.h>
#include <unistd.h>

#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "proto/frames.h"
#include "proto/program/exit_code.h"
#include "proto/program/log.h"
#include "proto/program/parent.h"
#include "proto/program/stop_signals.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "server/loop.h"
#include "server/queries/reader_program.h"
#include "worker/solver/model/version.h"

namespace {

using oblique::protocol::StopWithParent;
using oblique::server::Loop;
using oblique::server::LoopSettings;

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

int run(const LoopSettings& settings, int ready_fd, const StopWithParent& parent) {
  const oblique::protocol::StopSignals stop;  // before any thread starts
  oblique::protocol::survive_failed_writes();
  if (!parent.begin()) {
    spdlog::warn("the parent process was gone before this one began");
    return oblique::protocol::kDone;
  }
  take_all_descriptors();
  Loop loop(settings);
  spdlog::info("database {}, clients at {}, workers at {}", settings.database,
               loop.client_endpoint(), loop.worker_endpoint());
  if (ready_fd >= 0) {
    tell_ready(ready_fd, loop);
  }
  const auto end = loop.run(stop.descriptor());
  return end.lost_writes == 0 && !end.lost_database ? oblique::protocol::kDone
                                                    : oblique::protocol::kFailed;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::string_view(argv[1]) == oblique::server::kReadMode) {
    return oblique::server::run_reader_program(argv[2]);
  }
  StopWithParent parent;
  oblique::protocol::silence_protobuf();
  oblique::protocol::set_up_log("oblique-server");

  LoopSettings settings;
  settings.database = "oblique.db";
  std::uint16_t worker_port = 7601;
  std::uint16_t client_port = 7600;
  int ready_fd = -1;
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
  app.add_option("--listen", settings.doors.listen,
                 "Address to listen on, * for all; beyond loopback only with --keys or --insecure");
  app.add_option(
      "--keys", settings.doors.keys,
      "Key file of the server, as `oblique keygen` makes it; the list of keys to let in, "
      "authorized_keys.toml, lies beside it");
  app.add_flag("--insecure", settings.doors.insecure,
               "Let in whoever reaches the ports, unencrypted");
  app.add_option("--worker-port", worker_port, "Port for workers; 0: the system picks one");
  app.add_option("--client-port", client_port, "Port for clients; 0: the system picks one");
  app.add_option("--ready-fd", ready_fd,
                 "File descriptor that gets one line of JSON with both endpoints once the server "
                 "can be used; -1: none")
      ->check(objection_to_descriptor);
  parent.add_to(app);
  app.add_flag("--quiet", quiet, "Log warnings and errors only");
  if (const auto exit_code = oblique::protocol::parse_command_line(app, argc, argv)) {
    return *exit_code;
  }
  try {
    if (worker_port == client_port && worker_port != 0) {
      throw std::runtime_error("--worker-port and --client-port are both " +
                               std::to_string(worker_port) + ": they must differ");
    }
    (void)oblique::server::address_to_bind(settings.doors);
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
    return run(settings, ready_fd, parent);
  } catch (const std::exception& error) {
    std::cerr << "oblique-server: " << oblique::protocol::visible_lines(error.what()) << '\n';
    return oblique::protocol::kFailed;
  }
}
