#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "server/service/ports/ports.h"
#include "server/service/worker_sessions.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// Requests of clients for traces, and the workers that solve them beside all batches. Not
/// thread-safe.
class TraceHandler {
 public:
  TraceHandler(std::string solver_version, std::int64_t still_working_every_ms, Ports& ports,
               WorkerSessions& workers)
      : solver_version_(std::move(solver_version)),
        still_working_every_ms_(still_working_every_ms),
        ports_(ports),
        workers_(workers) {}

  /// A request that waits already has no effect.
  void request(const Client& client, const protocol::TraceRequest& request, StudyId study,
               const StudyTable& table, Instant now);
  /// The client no longer waits for the answer to that request.
  void end(std::string_view identity, std::uint64_t request_id);
  void client_left(std::string_view identity);
  /// To be called several times a second.
  void tick(Instant now);
  void stop();

  /// For any reason. The sessions must have forgotten it.
  void worker_left(WorkerId worker);
  void trace_received(WorkerId worker, protocol::Trace trace);

 private:
  struct Job {
    Client client;
    bool only_point;
    std::int64_t deadline_ms;
    std::int64_t next_notice_ms;  ///< to the client
    protocol::TraceOrder order;
    protocol::TraceReply reply{};       ///< without the trace
    bool is_ready = false;              ///< the point is known
    std::optional<WorkerId> worker{};   ///< that solves it
    std::set<WorkerId> not_taken_by{};  ///< workers
    bool has_lost_worker = false;
  };
  /// A point of a study; without an objection it exists.
  struct FoundPoint {
    protocol::TraceReply reply;  ///< without the trace
    std::string objection;
  };
  using Jobs = std::map<std::uint64_t, Job>;

  static FoundPoint find_point(const protocol::PointTable& table, std::uint64_t point);
  static FoundPoint find_point(const std::string& recipe_bytes, std::uint64_t point);
  void point_found(std::uint64_t number, const FoundPoint& point);
  void dispatch();
  void answer(const Job& job, const WorkerRecord& worker, protocol::Trace trace);
  void refuse(Jobs::iterator job, const std::string& reason);
  void remove(Jobs::iterator job);
  void remove_jobs(const std::function<bool(const Client&)>& is_meant);

  std::string solver_version_;
  std::int64_t still_working_every_ms_;
  Ports& ports_;
  WorkerSessions& workers_;
  Jobs jobs_;  // by number, which is that of the order; the oldest first
  std::uint64_t last_number_ = 0;
  std::map<WorkerId, std::uint64_t> orders_;  // that workers have not answered
  WorkerId last_worker_ = 0;                  // that got an order
  bool is_stopping_ = false;
};

}  // namespace oblique::server
