#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "proto/system/descriptor.h"
#include "server/network/access.h"
#include "server/network/network.h"
#include "server/query/query_pool.h"
#include "server/service/ports.h"
#include "server/service/service.h"
#include "server/store/store.h"
#include "server/store/writer.h"
#include "server/web/web.h"

namespace oblique::server {

/// A queue of functions to run on the event loop's thread. A descriptor wakes the loop.
class CompletionQueue {
 public:
  using Completion = std::function<void()>;

  /// Thread-safe.
  void put(Completion completion) {
    const std::lock_guard lock(mutex_);
    completions_.push_back(std::move(completion));
    woken_.wake();
  }
  /// Runs all queued functions. To be called by the event loop.
  void run() {
    woken_.clear();
    std::vector<Completion> completions;
    {
      const std::lock_guard lock(mutex_);
      completions.swap(completions_);
    }
    for (const Completion& completion : completions) {
      completion();
    }
  }
  /// Becomes readable when the queue is not empty.
  int descriptor() const { return woken_.descriptor(); }

 private:
  protocol::WakeUp woken_;
  std::mutex mutex_;
  std::vector<Completion> completions_;  // guarded by mutex_
};

/// Runs long checks one after another on its own thread. Callers limit the number of waiting
/// checks. The destructor drops waiting checks and waits for the running one.
class CheckThread {
 public:
  /// `done` is called on this object's thread after each check.
  explicit CheckThread(std::function<void(Ports::Completion)> done)
      : done_(std::move(done)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

  void submit(Ports::Check check) {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(check));
    wake_.notify_all();
  }

 private:
  void run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (wake_.wait(lock, stop, [this] { return !waiting_.empty(); }) && !stop.stop_requested()) {
      const Ports::Check check = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      done_(check());
      lock.lock();
    }
  }

  const std::function<void(Ports::Completion)> done_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<Ports::Check> waiting_;  // guarded by mutex_
  std::jthread thread_;               // declared last, because it uses the other members
};

/// The state of the loop, which is reported to the service manager.
struct LoopState {
  enum class Stage { kRuns, kDrains, kEnds };
  Stage stage;
  std::size_t workers;
  std::size_t leases;  ///< number of batches that workers hold
};

struct LoopSettings {
  std::string database;              ///< path of the database file
  bool allow_network_disk = false;   ///< if true, the file may be on a network file system
  AccessSettings access;             ///< access settings of both ports
  std::string worker_port = "7601";  ///< "*": chosen by the system
  std::string client_port = "7600";
  QueryPoolSettings queries;
  NetworkLimits network;
  std::optional<WebSettings> web;  ///< EventLoop sets `web->database` and `web->solver_version`
  /// Time to wait for leased batches after a request to stop; 0 to stop without waiting.
  std::chrono::milliseconds drain{0};
  /// Called on the loop's thread several times a second, and once when the loop ends.
  std::function<void(const LoopState&)> on_turn = [](const LoopState&) {};
  /// The caller must set `service.solver_version`. EventLoop sets the numbers from the database.
  ServiceSettings service;
};

/// Outcome of a run of the loop.
struct LoopEnd {
  std::size_t lost_writes;  ///< number of changes that could not be stored
  bool lost_database;       ///< true if the file was deleted or replaced, or a sync failed
};

/// The server: a loop that passes input from network, HTTP, writer, query pool and check thread to
/// the service. It logs to spdlog's default logger.
class EventLoop final : private Ports {
 public:
  /// Opens the database and binds both ports. Throws StorageError if the database cannot be opened
  /// or is on a network file system; solver::InputError for an address that is not allowed;
  /// std::runtime_error if a port cannot be bound.
  explicit EventLoop(LoopSettings settings);

  /// Return the ZeroMQ endpoints, with the actual ports.
  std::string client_endpoint() const { return network_.endpoint(clients_); }
  std::string worker_endpoint() const { return network_.endpoint(workers_); }
  /// Returns an address such as http://127.0.0.1:7602; empty without HTTP.
  std::string http_url() const { return web_ ? web_->url() : std::string(); }
  /// Returns the address of the page with its token; empty without HTTP.
  std::string page_url() const { return web_ ? web_->page_url() : std::string(); }

  /// Runs until `stop_fd` becomes readable or the database is lost. Then notifies workers, stores
  /// and acknowledges received results, and returns. With `drain` it first waits for leased
  /// batches. `take_stop` must empty `stop_fd`, so that a second signal can end this wait.
  LoopEnd run(int stop_fd, const std::function<void()>& take_stop = {});

 private:
  using Clock = std::chrono::steady_clock;

  Delivery to_worker(const std::string& identity, const std::string& frame) override;
  bool is_busy(const std::string& identity) const override { return network_.is_busy(identity); }
  bool has_unread_input(const std::string& identity) const override {
    return network_.has_unread_input(identity);
  }
  bool to_client(const std::string& identity, const std::string& frame) override;
  void add_peers(protocol::WorkersReply& reply) const override;
  void write(WriteJob job) override { writer_.submit(std::move(job)); }
  bool query(QueryJob job) override { return queries_.submit(std::move(job)); }
  void more_rows(std::uint64_t query, std::uint64_t received) override {
    queries_.more(query, received);
  }
  void cancel_query(std::uint64_t ticket) override { queries_.cancel(ticket); }
  void run_check(Check check) override { checks_.submit(std::move(check)); }
  void log(Severity severity, const std::string& text) override;

  bool take_worker_messages();
  bool take_client_messages();
  template <typename Take>
  bool take_messages(Network::Port port, const Network::MayTake& may_take, const Take& take);
  void take_completions();
  void note_disconnects();
  void check_access();
  void tick();
  void publish();
  void report(LoopState::Stage stage) const;
  bool begin_drain(const std::function<void()>& take_stop);
  bool is_drained() const;
  LoopEnd finish();
  void wait_for_readers();

  const std::chrono::milliseconds drain_;
  const std::function<void(const LoopState&)> on_turn_;
  std::optional<Clock::time_point> drain_until_;  ///< end of the wait for batches, if any
  AccessControl access_;
  Store store_;
  CompletionQueue completions_;
  Writer writer_;
  QueryPool queries_;
  CheckThread checks_;
  Network network_;
  Network::Port workers_;
  Network::Port clients_;
  std::unique_ptr<Web> web_;
  bool is_ending_ = false;
  std::vector<std::string> last_answered_;  ///< clients to which the ending server sent a message
  std::optional<Service> service_;
};

}  // namespace oblique::server
