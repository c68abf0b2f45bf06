#include "client/service/embedded_service.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <iterator>
#include <thread>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/service/connection.h"
#include "proto/system/available_memory.h"
#include "worker/solver/model/fall_model.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;

// A server with a large database first reads what is done; more than this is no start.
constexpr std::chrono::seconds kReadyWithin{60};
// A worker ends its point first, which on fine meshes takes long; the server commits.
constexpr std::chrono::seconds kStopWithin{5};

std::string with_last_words(const std::string& what, const ChildProcess& child) {
  const auto words = child.last_words();
  return words.empty() ? what : fmt::format("{}; its last words:\n{}", what, words);
}

ChildSettings server_settings(const ServiceSettings& settings, const KeysForARun& keys, int ready) {
  ChildSettings child{
      .program = sibling_program("oblique-server"),
      .arguments = {"--no-config", "--db", settings.database.string(), "--drain", "0",
                    "--worker-port", "0", "--client-port", "0", "--http", settings.http,
                    "--ready-fd", std::to_string(ChildProcess::kHandedOver), "--stop-with-parent",
                    std::to_string(getpid()), "--keys", keys.file_of(protocol::Role::kServer)},
      .show_errors = settings.verbose,
      .handed_over = ready};
  if (!settings.only_study.empty()) {
    child.arguments.push_back("--only-study=" + settings.only_study);
  }
  if (settings.allow_network_disk) {
    child.arguments.emplace_back("--allow-network-disk");
  }
  return child;
}

// Waits until none of `children` runs, and kills what still does at the end of the time.
void end_all(const std::vector<ChildProcess*>& children) {
  for (auto* child : children) {
    child->send(SIGTERM);
  }
  const auto deadline = Clock::now() + kStopWithin;
  const auto runs = [](ChildProcess* child) { return child->is_running(); };
  while (std::any_of(children.begin(), children.end(), runs)) {
    if (Clock::now() > deadline) {
      for (auto* child : children) {
        child->send(SIGKILL);
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// The line that a server writes when it is ready.
class ReadyLine {
 public:
  ReadyLine(const Descriptor& ready, ChildProcess& server, std::filesystem::path database)
      : ready_(ready), server_(server), database_(std::move(database)) {}

  /// The line; empty when the server closes the pipe without one. Throws ProcessError when none
  /// comes in time, and Interrupted when `stop` is requested.
  std::string read(protocol::StopSignals& stop) {
    const auto deadline = Clock::now() + kReadyWithin;
    std::size_t end = 0;
    while ((end = held_.find('\n')) == std::string::npos) {
      if (stop.requested()) {
        throw Interrupted("stopped before the server was ready");
      }
      if (Clock::now() > deadline) {
        throw ProcessError(with_last_words(
            fmt::format("no answer within {} s: {}", kReadyWithin.count(), why_silent(database_)),
            server_));
      }
      pollfd waited{ready_.number(), POLLIN, 0};
      constexpr int kSlice_ms = 50;
      if (poll(&waited, 1, kSlice_ms) > 0 && !read_more()) {
        return {};
      }
    }
    return held_.substr(0, end);
  }

 private:
  bool read_more() {
    std::array<char, 512> bytes{};
    const auto got = ::read(ready_.number(), bytes.data(), bytes.size());
    if (got > 0) {
      held_.append(bytes.data(), static_cast<std::size_t>(got));
    }
    return got > 0 || (got < 0 && errno == EINTR);
  }

  const Descriptor& ready_;
  ChildProcess& server_;
  std::filesystem::path database_;
  std::string held_;
};

/// Memory for the falls of each worker: an equal share of the setting or, by default, of an eighth
/// of what is free.
std::uint64_t fall_memory_each(const ServiceSettings& settings) {
  const std::uint64_t all_bytes =
      settings.fall_memory_bytes != 0
          ? settings.fall_memory_bytes
          : protocol::available_memory_bytes() / solver::kFallsPartOfMemory;
  return std::max<std::uint64_t>(all_bytes / static_cast<std::uint64_t>(settings.workers), 1);
}

/// Threads of each worker, so that all together use the cores of this machine.
unsigned threads_each(int workers) {
  return std::max(1U, std::thread::hardware_concurrency() / static_cast<unsigned>(workers));
}

}  // namespace

std::string why_silent(const std::filesystem::path& database) {
  return fmt::format(
      "the server that was started here runs, and waits for its database {0}, which is slow or "
      "damaged. `oblique check --db {0}` examines it",
      database.string());
}

EmbeddedService::EmbeddedService(const ServiceSettings& settings, protocol::StopSignals& stop) {
  const auto worker_program = sibling_program("oblique-worker");
  Pipe ready;
  server_ = std::make_unique<ChildProcess>(server_settings(settings, keys_, ready.write.number()));
  // Only the server holds it now, so its end shows on ours.
  ready.write.close();
  wait_until_ready(ready.read, settings, stop);
  for (int i = 0; i < settings.workers; ++i) {
    workers_.push_back(std::make_unique<ChildProcess>(
        ChildSettings{.program = worker_program,
                      .arguments = {"--no-config", "--server", worker_url_, "--keys",
                                    keys_.file_of(protocol::Role::kWorker), "--stop-with-parent",
                                    std::to_string(getpid()), "--threads",
                                    std::to_string(threads_each(settings.workers)), "--fall-memory",
                                    std::to_string(fall_memory_each(settings))},
                      .show_errors = settings.verbose}));
  }
}

EmbeddedService::~EmbeddedService() {
  stop();
}

void EmbeddedService::wait_until_ready(const Descriptor& ready, const ServiceSettings& settings,
                                       protocol::StopSignals& stop) {
  ReadyLine line(ready, *server_, settings.database);
  const auto urls = nlohmann::json::parse(line.read(stop), nullptr, false);
  if (urls.is_object() && urls.contains("client") && urls.contains("worker") &&
      urls["client"].is_string() && urls["worker"].is_string()) {
    client_url_ = urls["client"];
    worker_url_ = urls["worker"];
    page_url_ = urls.value("page", std::string());
    return;
  }
  // It closed the pipe because it ends: let it, so that its last words are whole.
  const auto deadline = Clock::now() + kStopWithin;
  while (server_->is_running() && Clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  throw ProcessError(
      with_last_words(fmt::format("the server did not start: it {}", server_->ending()), *server_));
}

void EmbeddedService::check() {
  if (!server_->is_running()) {
    throw ProcessError(with_last_words(fmt::format("the server {}", server_->ending()), *server_));
  }
  const bool any = std::any_of(workers_.begin(), workers_.end(),
                               [](const auto& worker) { return worker->is_running(); });
  if (!any) {
    throw ProcessError(with_last_words(
        fmt::format("no worker is left: the last one {}", workers_.back()->ending()),
        *workers_.back()));
  }
}

std::string EmbeddedService::news() {
  std::string text;
  for (const auto& worker : workers_) {
    if (!worker->is_running() && reported_.insert(worker->pid()).second) {
      text += text.empty() ? "" : "\n";
      text += with_last_words(
          fmt::format("a worker (process {}) {}", worker->pid(), worker->ending()), *worker);
    }
  }
  return text;
}

void EmbeddedService::stop() {
  std::vector<ChildProcess*> workers;
  std::transform(workers_.begin(), workers_.end(), std::back_inserter(workers),
                 [](const auto& worker) { return worker.get(); });
  end_all(workers);
  if (server_) {
    end_all({server_.get()});
  }
}

}  // namespace oblique::client
