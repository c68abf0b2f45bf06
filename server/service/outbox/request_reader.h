#pragma once

#include <array>
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
  bool needs_survey = false;        ///< the points of the recipe must be looked at, and were not
  std::shared_ptr<protocol::PointTable> unsurveyed;  ///< of such a recipe
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
  std::string client = {};  ///< whose it is: a key's holder, or a connection
};
struct ReadReport {
  std::uint64_t ticket;
  ReadRequest read;
  std::optional<TracedPoint> point = {};
};

/// Reads long requests and recipes on a thread of its own, so that a large recipe holds up nothing
/// but other large ones. Recipes whose points must be looked at go on to a second thread, a short
/// time each while others wait. Whose turn it is: by turns that of the client whose requests took
/// least time, its smallest one, and that of the request that waits the longest.
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
  using Clock = std::chrono::steady_clock;

  struct Waiting {
    ReadJob job;
    std::uint64_t size = 0;  ///< bytes, or points to look at
    ReadRequest read = {};   ///< where it is to be surveyed
  };
  /// One of the threads: what waits for it, in the order in which it began to, and what it is at.
  struct Line {
    std::deque<Waiting> waiting;
    std::uint64_t ticket = 0;
    bool is_wanted = false;
    std::uint64_t turns = 0;
    std::map<std::string, Clock::duration> spent;  ///< on clients of whom something waits
  };

  void run(Line& line, bool surveys);
  Waiting next(Line& line);
  static ReadReport read(const ReadJob& job);
  bool survey(Waiting& waiting, Clock::duration spent);

  Report report_;
  std::mutex mutex_;
  std::condition_variable wake_;
  Line reading_;                        // guarded by mutex_
  Line surveying_;                      // guarded by mutex_
  bool stopping_ = false;               // guarded by mutex_
  std::array<std::thread, 2> threads_;  // last: they use all the others
};

}  // namespace oblique::server
