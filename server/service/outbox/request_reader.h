#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "proto/oblique.pb.h"
#include "server/scheduler/points/study_table.h"

namespace oblique::server {

/// A client's request, read and, if it submits a study, with the recipe judged.
struct ReadRequest {
  bool is_readable = false;         ///< else it is no message, and only the number counts
  std::uint64_t request_id = 0;     ///< 0: it cannot be read
  protocol::ClientRequest request;  ///< its recipe is moved into the table
  StudyTable table;                 ///< of a submission that has no fault
  std::string objection;            ///< what is wrong with the recipe; empty: nothing
  bool needs_survey = false;        ///< the points of the recipe must be looked at, and were not
};

/// Reads one frame. Costs time and memory in proportion to its bytes: a long one that is padded
/// with empty messages is not read. Where points of a recipe must be looked at, to count what a
/// filter leaves in or to judge what follows from an expression, it takes up to minutes more:
/// `goes_on` is asked now and then, and false ends it with an objection. Without `goes_on` nobody
/// looks, and the request `needs_survey`.
ReadRequest read_request(std::string_view frame, const std::function<bool()>& goes_on);
inline ReadRequest read_request(std::string_view frame) {
  return read_request(frame, [] { return true; });
}

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
};
struct ReadReport {
  std::uint64_t ticket;
  ReadRequest read;
  std::optional<TracedPoint> point = {};
};

/// Reads long requests and recipes one after another on a thread of its own, so that a large recipe
/// holds up nothing but other large ones. Recipes whose points must be looked at go on to a second
/// thread, and hold up nothing but each other.
class RequestReader {
 public:
  using Report = std::function<void(ReadReport)>;

  /// `report` is called on the reader's threads.
  explicit RequestReader(Report report);
  /// Drops what waits, and waits for the one that is being read.
  ~RequestReader();
  RequestReader(const RequestReader&) = delete;
  RequestReader& operator=(const RequestReader&) = delete;

  void submit(ReadJob job);
  /// Nobody waits for the answer any more: the report may not come, or with an objection.
  void cancel(std::uint64_t ticket);

 private:
  /// One of the threads: what waits for it, and what it is at.
  struct Line {
    std::deque<ReadJob> waiting;
    std::uint64_t ticket = 0;
    bool is_wanted = false;
  };

  void run(Line& line, bool surveys);
  ReadReport read(const ReadJob& job, bool surveys);

  Report report_;
  std::mutex mutex_;
  std::condition_variable wake_;
  Line reading_;                        // guarded by mutex_
  Line surveying_;                      // guarded by mutex_
  bool stopping_ = false;               // guarded by mutex_
  std::array<std::thread, 2> threads_;  // last: they use all the others
};

}  // namespace oblique::server
