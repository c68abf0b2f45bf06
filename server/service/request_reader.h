#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
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
};

/// Reads one frame. Costs time and memory in proportion to its bytes: a long one that is padded
/// with empty messages is not read.
ReadRequest read_request(std::string_view frame);

/// A frame that is too long to be read in the loop.
struct ReadJob {
  std::uint64_t ticket;
  std::string frame;
};
struct ReadReport {
  std::uint64_t ticket;
  ReadRequest read;
};

/// Reads long requests one after another on a thread of its own, so that a large recipe holds up
/// nothing but other large requests.
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

 private:
  void run();

  Report report_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<ReadJob> queue_;  // guarded by mutex_
  bool stopping_ = false;      // guarded by mutex_
  std::thread thread_;         // last: it uses all the others
};

}  // namespace oblique::server
