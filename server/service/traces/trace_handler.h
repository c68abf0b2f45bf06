#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler_events.h"
#include "server/service/ports/ports.h"
#include "server/service/traces/traced_point.h"

namespace oblique::server {

/// Requests of clients for traces, and the workers that solve them beside all batches. Not
/// thread-safe.
class TraceHandler {
 public:
  TraceHandler(std::string solver_version, Ports& ports, std::int64_t still_working_every_ms)
      : solver_version_(std::move(solver_version)),
        ports_(ports),
        still_working_every_ms_(still_working_every_ms) {}

  /// A request that waits already has no effect.
  void request(const Client& client, const protocol::TraceRequest& request, StudyId study,
               const StudyTable& table, Instant now);
  /// The client no longer waits for the answer to that request.
  void end(std::string_view identity, std::uint64_t request_id);
  void client_left(std::string_view identity);
  /// To be called several times a second.
  void tick(Instant now);
  void stop();

  void joined(WorkerId worker, const std::string& name, const std::string& instruction_set);
  /// For any reason.
  void left(WorkerId worker);
  /// It does not read what it is sent, or reads again.
  void set_busy(WorkerId worker, bool is_busy);
  void trace_received(WorkerId worker, protocol::Trace trace);

  /// Messages for workers, in order.
  using Messages = std::vector<std::pair<WorkerId, protocol::ServerToWorker>>;
  Messages take_messages() { return std::exchange(messages_, {}); }

 private:
  /// A point that workers were lost with.
  using PointId = std::pair<StudyId, std::uint64_t>;
  struct Job {
    std::vector<Client> clients;  ///< that requested it
    PointId point;
    bool only_point;
    std::int64_t deadline_ms;
    std::int64_t next_notice_ms;  ///< to the clients
    protocol::TraceOrder order;
    protocol::TraceReply reply{};    ///< without the trace
    bool is_ready = false;           ///< the point is known
    std::optional<WorkerId> worker;  ///< that solves it
    std::set<WorkerId> not_taken_by{};
    int losses = 0;
  };
  struct Solver {
    std::string name;
    std::string instruction_set;
    bool is_busy = false;
    std::uint64_t order = 0;       ///< that it has not answered; 0: none
    std::uint64_t last_order = 0;  ///< that it was given
  };
  /// The workers that could solve a point.
  struct Choice {
    bool has_any = false;
    std::optional<WorkerId> free{};  ///< without a trace for longest
  };
  using Jobs = std::map<std::uint64_t, Job>;

  void point_found(std::uint64_t number, const TracedPoint& point);
  std::string objection_to(const Client& client) const;
  Jobs::iterator find_same(const Job& job);
  void reply(const Job& job, protocol::ClientReply reply);
  void dispatch();
  Choice choose_solver(const Job& job) const;
  void answer(Job& job, const Solver& solver, protocol::Trace trace);
  void refuse(Jobs::iterator job, const std::string& reason);
  Jobs::iterator remove(Jobs::iterator job);
  void remove_clients(const std::function<bool(const Client&)>& is_meant);

  std::string solver_version_;
  Ports& ports_;
  std::int64_t still_working_every_ms_;
  Jobs jobs_;  // by number, which is that of the order; the oldest first
  std::uint64_t last_number_ = 0;
  std::map<WorkerId, Solver> solvers_;
  std::set<PointId> deadly_;
  Messages messages_;
  bool is_stopping_ = false;
};

}  // namespace oblique::server
