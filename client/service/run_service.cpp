#include "client/service/run_service.h"

#include <netinet/in.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/io/console.h"
#include "client/service/connection.h"
#include "client/service/watching.h"
#include "client/study/study.h"
#include "proto/result_message.h"
#include "proto/system/resources.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;

// Startup takes long for a large database, because the server first reads the completed points.
constexpr std::chrono::seconds kReadyWithin{60};
// Processes need time to end: a worker finishes its point (slow on fine meshes), and the server
// commits.
constexpr std::chrono::seconds kStopWithin{5};
constexpr std::chrono::milliseconds kPause{1};

std::string with_last_output(const std::string& what, const ChildProcess& child) {
  const auto words = child.last_output();
  return words.empty() ? what : fmt::format("{}; its last output:\n{}", what, words);
}

/// Waits until all children have ended; kills those that still run after `time`.
void end_all(const std::vector<std::unique_ptr<ChildProcess>>& children) {
  for (const auto& child : children) {
    child->send(SIGTERM);
  }
  const auto deadline = Clock::now() + kStopWithin;
  for (const auto& child : children) {
    while (child->is_running() && Clock::now() < deadline) {
      std::this_thread::sleep_for(kPause);
    }
    child->send(SIGKILL);
    child->wait();
  }
}

/// Returns the endpoints that the server writes to `ready`, or no object if it closes the pipe
/// first. Throws ProcessError if no line arrives in time, and Interrupted when `stop` is requested.
nlohmann::json endpoints(const Descriptor& ready, const ChildProcess& server,
                         const ServiceSettings& settings, protocol::StopSignals& stop) {
  auto deadline = Clock::now() + kReadyWithin;
  std::string text;
  while (true) {
    for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
      auto line = nlohmann::json::parse(text.substr(0, end), nullptr, false);
      if (!line.is_object() || !line.contains("waits_for")) {
        return line;
      }
      if (settings.tell) {
        settings.tell(line.value("waits_for", std::string()));
      }
      deadline = Clock::time_point::max();
      text.erase(0, end + 1);
    }
    if (stop.requested()) {
      throw Interrupted("stopped before the server was ready");
    }
    if (Clock::now() > deadline) {
      throw ProcessError(
          with_last_output(fmt::format("no answer within {} s: {}", kReadyWithin.count(),
                                       why_silent(settings.database)),
                           server));
    }
    constexpr int kSlice_ms = 50;
    pollfd waited{ready.number(), POLLIN, 0};
    if (poll(&waited, 1, kSlice_ms) <= 0) {
      continue;
    }
    std::array<char, 512> bytes{};
    const auto got = ::read(ready.number(), bytes.data(), bytes.size());
    if (got == 0 || (got < 0 && errno != EINTR)) {
      return {};
    }
    text.append(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  }
}

RunEnd submit_and_wait(Console& console, const Study& study, const RunSettings& settings,
                       EmbeddedService& service, protocol::StopSignals& stop) {
  const auto keep_waiting = [&] {
    service.check();
    if (const auto news = service.news(); !news.empty()) {
      console.notes() << protocol::visible_lines(news) << '\n';
    }
    return !stop.requested();
  };
  ConnectionSettings where;
  where.server_url = service.client_url();
  where.key = service.client_key();
  where.if_silent = why_silent(settings.service.database);
  Connection connection(where, keep_waiting);
  const auto submitted = connection.submit(study, {.no_reuse = settings.no_reuse});
  if (submitted.created()) {
    note_coarse_mesh(console.notes(), study.recipe);
  } else {
    console.notes() << fmt::format("Continuing \"{}\": {} of {} points are done.\n", study.name,
                                   format_count(submitted.completed()),
                                   format_count(submitted.points()));
  }
  if (const std::string taken = reused_points_note(submitted.reused()); !taken.empty()) {
    console.notes() << fmt::format("\"{}\": {}\n", study.name, taken);
  }
  FollowedStudy followed(connection, study.name);
  const auto ask = [&](const Tell& tell) {
    keep_waiting();
    auto status = followed.status(tell);
    if (const auto reason = objection_to_waiting(status); !reason.empty()) {
      throw std::runtime_error(reason);
    }
    return status;
  };
  RunEnd end;
  end.status = watch_study(console, ask, stop);
  if (stop.requested()) {
    throw Interrupted("stopped");
  }
  const Tell tell = tell_errors(console);
  const auto query = [&](const std::string& sql) { return connection.query(sql, tell); };
  end.rows = connection.chunks(request_for({.study = study.name, .limit = settings.rows}), tell);
  end.exit_code = print_end(console, end.status, query);
  return end;
}

}  // namespace

std::string objection_to_waiting(const protocol::StudyStatus& status) {
  const std::string own = solver::solver_version();
  if (status.state() == "paused" && status.leased() == 0) {
    return fmt::format("\"{}\" was paused by another command: run this command again to continue",
                       status.name());
  }
  if (status.state() != "running" || status.solver_version().empty() ||
      status.solver_version() == own || status.leased() > 0) {
    return {};
  }
  return fmt::format(
      "the results of \"{0}\" are of solver {1}, but the workers here have solver {2} and must not "
      "solve its other {3} points. Use workers of {1}, or another name, for example --name {0}-{2}",
      status.name(), status.solver_version(), own, format_count(protocol::open_points(status)));
}

std::string why_silent(const std::filesystem::path& database) {
  return fmt::format(
      "the server runs, but does not answer: its database {0} may be slow or damaged, which "
      "`oblique "
      "check --db {0}` examines, or a firewall may block 127.0.0.1",
      database.string());
}

EphemeralKeys::EphemeralKeys() {
  const std::string named = environment_variable("TMPDIR").value_or("");
  folder_ = (named.empty() ? "/tmp" : named) + "/oblique-run-XXXXXX";
  if (::mkdtemp(folder_.data()) == nullptr) {
    throw std::runtime_error(
        fmt::format("cannot create a folder for keys in {}: {}. TMPDIR may name another folder, "
                    "which must exist",
                    named.empty() ? "/tmp" : named, std::strerror(errno)));
  }
  try {
    protocol::make_key_folder(folder_);
  } catch (const std::runtime_error&) {
    ::rmdir(folder_.c_str());
    throw;
  }
}

EphemeralKeys::~EphemeralKeys() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string EphemeralKeys::file_of(protocol::Role role) const {
  return protocol::key_file_in(folder_, std::string(name_of(role)));
}

EmbeddedService::EmbeddedService(const ServiceSettings& settings, protocol::StopSignals& stop) {
  static_cast<void>(sibling_program("oblique-worker"));  // throws early if the program is missing
  start_server(settings, stop);
  for (int i = 0; i < settings.workers; ++i) {
    start_worker(settings);
  }
}

void EmbeddedService::start_server(const ServiceSettings& settings, protocol::StopSignals& stop) {
  Pipe ready;
  ChildSettings child{
      .program = sibling_program("oblique-server"),
      .arguments = {"--no-config", "--db", settings.database.string(), "--drain", "0",
                    "--worker-port", "0", "--client-port", "0", "--http", settings.http,
                    "--ready-fd", std::to_string(ChildProcess::kHandedOver), "--page-of-file",
                    "--stop-with-parent", std::to_string(getpid()), "--keys",
                    keys_.file_of(protocol::Role::kServer)},
      .show_errors = settings.verbose,
      .handed_over = ready.write.number()};
  if (!settings.only_study.empty()) {
    child.arguments.push_back("--only-study=" + settings.only_study);
  }
  if (settings.allow_network_disk) {
    child.arguments.emplace_back("--allow-network-disk");
  }
  server_ = std::make_unique<ChildProcess>(child);
  ready.write.close();  // now the pipe closes when the server ends
  const auto urls = endpoints(ready.read, *server_, settings, stop);
  if (urls.is_object() && urls.contains("client") && urls.contains("worker")) {
    client_url_ = urls.value("client", std::string());
    worker_url_ = urls.value("worker", std::string());
    page_url_ = urls.value("page", std::string());
    // Connecting a UDP socket sends nothing. It fails if the address cannot be reached.
    const Descriptor probe(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const sockaddr_in loopback{AF_INET, htons(1), {htonl(INADDR_LOOPBACK)}, {}};
    if (::connect(probe.number(), reinterpret_cast<const sockaddr*>(&loopback), sizeof loopback)) {
      throw ProcessError(fmt::format(
          "cannot connect to 127.0.0.1: {}. Is the loopback interface up?", std::strerror(errno)));
    }
    return;
  }
  // The server closes the pipe when it ends; its output is then complete.
  const auto deadline = Clock::now() + kStopWithin;
  while (server_->is_running() && Clock::now() < deadline) {
    std::this_thread::sleep_for(kPause);
  }
  throw ProcessError(with_last_output(
      fmt::format("the server did not start: it {}", server_->ending()), *server_));
}

void EmbeddedService::start_worker(const ServiceSettings& settings) {
  // The workers share the cores, and the memory for cached falls.
  const auto workers = static_cast<unsigned>(settings.workers);
  const unsigned cores = protocol::usable_processors().count;
  const unsigned threads =
      std::max(1U, cores / workers + (workers_.size() < cores % workers ? 1U : 0U));
  const std::uint64_t all_bytes =
      settings.fall_memory_bytes != 0
          ? settings.fall_memory_bytes
          : protocol::available_memory_bytes() / solver::kFallsPartOfMemory;
  workers_.push_back(std::make_unique<ChildProcess>(ChildSettings{
      .program = sibling_program("oblique-worker"),
      .arguments = {"--no-config", "--server", worker_url_, "--keys",
                    keys_.file_of(protocol::Role::kWorker), "--stop-with-parent",
                    std::to_string(getpid()), "--threads", std::to_string(threads), "--fall-memory",
                    std::to_string(std::max<std::uint64_t>(all_bytes / workers, 1))},
      .show_errors = settings.verbose}));
}

void EmbeddedService::check() {
  if (!server_->is_running()) {
    throw ProcessError(with_last_output(fmt::format("the server {}", server_->ending()), *server_));
  }
  if (std::none_of(workers_.begin(), workers_.end(),
                   [](const auto& worker) { return worker->is_running(); })) {
    throw ProcessError(with_last_output(
        fmt::format("no worker is left: the last one {}", workers_.back()->ending()),
        *workers_.back()));
  }
}

std::string EmbeddedService::news() {
  std::string text;
  for (const auto& worker : workers_) {
    if (!worker->is_running() && reported_.insert(worker->pid()).second) {
      text += text.empty() ? "" : "\n";
      text += with_last_output(
          fmt::format("a worker (process {}) {}", worker->pid(), worker->ending()), *worker);
    }
  }
  return text;
}

void EmbeddedService::stop() {
  end_all(std::exchange(workers_, {}));
  std::vector<std::unique_ptr<ChildProcess>> server;
  if (server_) {
    server.push_back(std::move(server_));
  }
  end_all(server);
}

void add_worker_flags(CLI::App& command, RunSettings& settings) {
  command
      .add_option("--workers", settings.service.workers,
                  "number of worker processes, which share the cores of this machine")
      ->check(CLI::Range(1, 1024).description(""))
      ->type_name("N")
      ->capture_default_str();
  command
      .add_option("--fall-memory", settings.service.fall_memory_bytes,
                  "memory for solved falls of all workers together, such as 2GB; default: an "
                  "eighth of the free memory")
      ->type_name("SIZE")
      ->transform(CLI::AsSizeValue(false).description(""));
  command.add_flag("--verbose", settings.service.verbose,
                   "print what the server and workers report");
}

std::optional<RunEnd> run_study(Console& console, const Study& study, const RunSettings& settings,
                                protocol::StopSignals& stop) {
  try {
    ServiceSettings how = settings.service;
    how.only_study = study.name;
    how.tell = [&console](const std::string& sentence) { console.note(sentence); };
    EmbeddedService service(how, stop);
    auto end = submit_and_wait(console, study, settings, service, stop);
    service.stop();
    return end;
  } catch (const Interrupted&) {
    console.notes() << fmt::format(
        "Stopped. Results of \"{}\" are stored in {}; the same command continues the study.\n",
        study.name, settings.service.database.string());
    return std::nullopt;
  }
}

}  // namespace oblique::client
