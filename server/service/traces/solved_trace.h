#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/scheduler/scheduler_events.h"
#include "server/service/traces/traced_point.h"

namespace oblique::server {

/// Which trace is meant.
struct TraceKey {
  StudyId study = 0;
  std::uint64_t point = 0;
  bool shape = false;  ///< with the positions of the nodes
  bool fall = false;   ///< with rows of the fall

  bool operator==(const TraceKey&) const = default;
  bool operator<(const TraceKey& other) const {
    return std::tie(study, point, shape, fall) <
           std::tie(other.study, other.point, other.shape, other.fall);
  }
};

/// A trace as it comes in from a worker. What comes is taken for hostile.
class SolvedTrace {
 public:
  SolvedTrace(const TraceKey& key, const TracedPoint& point, std::size_t most_bytes);

  /// Adds rows behind those that are there. Why they can be none, or an empty text.
  std::string add(const protocol::TraceRows& rows);
  /// What solving gave, and who solved it. Why it can be no result, or an empty text.
  std::string finish(const protocol::TracePart& last, const std::string& worker,
                     const std::string& solver_version, const std::string& instruction_set);
  /// Forgets what came: it is solved anew.
  void start_over();

  bool has_failed() const { return !head_.result().error().empty(); }
  std::size_t rows() const { return states_.size(); }
  std::size_t bytes() const;
  /// The reply to a client that wants the rows from that one on; as many as one reply may have.
  /// The result comes with the first ones.
  protocol::TraceReply reply(std::uint64_t first_row) const;

 private:
  std::string fault_of_fall(const std::string& states) const;

  protocol::TraceReply head_;  // without rows
  std::size_t numbers_a_row_;
  bool has_fall_;
  std::size_t most_bytes_;
  std::vector<double> values_;
  std::string states_;
};

/// Those traces that were looked at last, as far as a bound on their bytes goes: a client asks for
/// one several times, part by part.
class KeptTraces {
 public:
  explicit KeptTraces(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void keep(const TraceKey& key, SolvedTrace trace);
  /// nullptr: it is not kept. Valid until the next call.
  const SolvedTrace* find(const TraceKey& key);

 private:
  struct Kept {
    TraceKey key;
    SolvedTrace trace;
  };
  std::size_t most_bytes_;
  std::size_t bytes_ = 0;
  std::list<Kept> kept_;  // the one looked at last comes first
};

}  // namespace oblique::server
