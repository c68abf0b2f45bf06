#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/event_loop/check_thread.h"
#include "server/network/access.h"
#include "server/network/network.h"
#include "server/query/query_pool.h"
#include "server/service/service.h"
#include "server/store/store.h"
#include "server/store/writer.h"
#include "server/web/web.h"

namespace oblique::server {

/// The state of the loop, as the service manager gets it.
struct LoopState {
  enum class Stage { kRuns, kDrains, kEnds };
  Stage stage;
  std::size_t workers;
  std::size_t leases;  ///< batches that are with workers
};

struct LoopSettings {
  std::string database;              ///< file
  bool allow_network_disk = false;   ///< the file may lie on a network file system
  AccessSettings access;             ///< of both ports
  std::string worker_port = "7601";  ///< "*": the system picks one
  std::string client_port = "7600";
  QueryPoolSettings queries;
  NetworkLimits network;
  std::optional<WebSettings> web;  ///< database and solver version are those of the server
  /// On a request to stop, time to wait for results under way; 0: none.
  std::chrono::milliseconds drain{0};
  /// Called on the loop's thread several times a second, and once as the loop ends.
  std::function<void(const LoopState&)> on_turn = [](const LoopState&) {};
  ServiceSettings service;  ///< solver_version must be set; the rest from the database
};

/// What the loop ended with.
struct LoopEnd {
  std::size_t lost_writes;  ///< changes that could not be made durable
  bool lost_database;       ///< it was deleted or replaced, and so the server ended
};

/// The server: one loop that passes what comes from network, HTTP, writer, query pool and check
/// thread to the service. Logs to spdlog's default logger.
class EventLoop final : private Ports {
 public:
  /// Opens the database and binds both ports. Throws StorageError, also for a file on a network
  /// file system, solver::InputError for an address that may not be listened on, and
  /// std::runtime_error for one that cannot.
  explicit EventLoop(LoopSettings settings);

  /// As ZeroMQ endpoints with the ports that are really used.
  std::string client_endpoint() const { return network_.endpoint(clients_); }
  std::string worker_endpoint() const { return network_.endpoint(workers_); }
  /// As http://127.0.0.1:7602; empty: without HTTP.
  std::string http_url() const { return web_ ? web_->url() : std::string(); }
  /// The address of the page with its token; empty: without HTTP.
  std::string page_url() const { return web_ ? web_->page_url() : std::string(); }

  /// Runs until `stop_fd` becomes readable or the database is gone; then notifies the workers,
  /// stores and acknowledges what was received and returns. With `drain` it first waits for results
  /// under way. `take_stop` then reads `stop_fd`, so that a second signal ends the wait.
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
  void more_rows(std::uint64_t query, std::uint64_t taken) override { queries_.more(query, taken); }
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
  std::optional<Clock::time_point> drain_until_;  ///< none: it does not drain
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
  std::uint64_t ended_connections_ = 0;
  std::array<std::uint64_t, kRefusalCauses> refused_{};  ///< by cause
  bool is_ending_ = false;
  std::vector<std::string> last_answered_;  ///< clients that were sent something at the end
  std::optional<Service> service_;
};

}  // namespace oblique::server
