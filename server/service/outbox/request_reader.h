#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "proto/oblique.pb.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// A client's request, read and, if it submits a study, with the recipe judged.
struct ReadRequest {
  bool is_readable = false;         ///< else it is no message, and only the number counts
  std::uint64_t request_id = 0;     ///< 0: it cannot be read
  protocol::ClientRequest request;  ///< its recipe is moved into the table
  StudyTable table;                 ///< of a submission that has no fault
  std::string objection;            ///< what is wrong with the recipe; empty: nothing
  bool needs_judging = false;       ///< the points of the recipe must be judged, and were not
};

/// Reads one frame. Costs time and memory in proportion to its bytes: a long one that is padded
/// with empty messages is not read. With `judges` the points of a recipe are judged too
/// (PointTable::judge_points), which may take 0.1 s; else the request `needs_judging`.
ReadRequest read_request(std::string_view frame, bool judges = true);

/// One point of a study, with all that solving it needs.
struct TracedPoint {
  protocol::ModelParameters model;
  double H_m = 0.0;
  double mu = 0.0;
  double e_star = 0.0;
  bool errors = false;    ///< its study wants estimated errors
  std::string objection;  ///< why there is no such point; empty: there is
};

TracedPoint traced_point(const protocol::PointTable& table, std::uint64_t point);
/// The reply that says what the point is, and nothing of its trace.
protocol::TraceReply said_of(const TracedPoint& point);

/// What is too long to be read in the loop: a frame, or where `of_study` is set the recipe of a
/// study, of which one point is wanted.
struct ReadJob {
  std::uint64_t ticket;
  std::string frame;
  std::optional<StudyTable> of_study = {};  ///< only its bytes are looked at
  std::uint64_t point = 0;
  std::string client = {};  ///< whose it is: a key's holder, or a connection
};
struct ReadReport {
  std::uint64_t ticket;
  ReadRequest read;
  std::optional<TracedPoint> point = {};
};

/// Reads long requests and recipes on a thread of its own, so that a large recipe holds up nothing
/// but other large ones. Whose turn it is: by turns that of the client whose requests took least
/// time, its smallest one, and that of the request that waits the longest.
class RequestReader {
 public:
  using Report = std::function<void(ReadReport)>;

  /// `report` is called on the reader's thread.
  explicit RequestReader(Report report);
  /// Drops what waits, and waits for the one that is being read.
  ~RequestReader();
  RequestReader(const RequestReader&) = delete;
  RequestReader& operator=(const RequestReader&) = delete;

  void submit(ReadJob job);
  /// Nobody waits for the answer any more: the report may not come, or with an objection.
  void cancel(std::uint64_t ticket);

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  ReadJob next();
  static ReadReport read(const ReadJob& job);

  Report report_;
  std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_.
  std::deque<ReadJob> waiting_;  // in the order in which they began to
  std::uint64_t turns_ = 0;
  std::map<std::string, Clock::duration> spent_;  // on clients of whom something waits
  bool stopping_ = false;
  std::thread thread_;  // last: it uses all the others
};

}  // namespace oblique::server
