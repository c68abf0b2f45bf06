#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/service/ports/ports.h"
#include "server/service/traces/trace_orders.h"

namespace oblique::server {

/// A study of which a point is to be looked at.
struct StudyToLookAt {
  StudyId id;
  const StudyTable& table;
  std::string solver_version;  ///< of its results; empty: there are none
};

/// The clients that wait for a trace. They hear now and then that it is waited for, by which the
/// server also finds out that one is gone. Points of long recipes are found on the reader's thread.
/// Not thread-safe.
class TraceDesk {
 public:
  TraceDesk(const TraceLimits& limits, const std::string& server_version, Ports& ports,
            std::int64_t word_every_ms)
      : ports_(ports),
        limits_(limits),
        orders_(limits, server_version),
        word_every_ms_(word_every_ms) {}

  /// The point must be one of the study's. Under the number of a request that waits already, it is
  /// that request.
  void ask(const Client& client, const protocol::TraceRequest& request, const StudyToLookAt& study,
           Instant now);
  /// That client waits no more for the answer to that request, if it was one for a trace.
  void end(std::string_view identity, std::uint64_t request_id);
  void client_left(std::string_view identity);
  /// To be called several times a second.
  void tick(Instant now);
  void stop();

  // As of TraceOrders.
  void joined(WorkerId worker, const std::string& name, const std::string& version,
              const std::string& instruction_set);
  void left(WorkerId worker);
  void set_busy(WorkerId worker, bool is_busy);
  void part(WorkerId worker, const protocol::TracePart& part);

  /// What is to be sent to workers: SendOrder and CancelOrder.
  std::vector<TraceEffect> take_orders() { return std::exchange(to_workers_, {}); }

 private:
  struct Waiting {
    Client client;
    std::string asker;  ///< whose share it counts for
    TraceQuestion question;
    std::string version;
    bool only_point;
    std::int64_t next_word_ms;
  };

  void found(std::uint64_t ticket, const TracedPoint& point, Instant now);
  bool is_full(const std::string& asker, const TraceKey& key) const;
  void answer_what_is_done();
  void end_those(const std::function<bool(const Client&)>& wait_no_more);
  bool tell(const Waiting& waiting);

  Ports& ports_;
  TraceLimits limits_;
  TraceOrders orders_;
  std::int64_t word_every_ms_;
  std::map<std::uint64_t, Waiting> waiting_;  // by ticket
  std::uint64_t last_ticket_ = 0;
  std::vector<TraceEffect> to_workers_;
  bool stopping_ = false;
};

}  // namespace oblique::server
