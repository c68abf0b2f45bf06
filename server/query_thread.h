#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "proto/oblique.pb.h"
#include "server/reader.h"

namespace oblique::server {

struct QueryJob {
  std::uint64_t ticket;
  protocol::QueryRequest request;
};

struct QueryReport {
  std::uint64_t ticket;
  protocol::QueryReply reply;
  std::string error;  ///< not empty: there is no reply
};

/// Runs queries one after another on a thread of their own, so that a long one holds up nothing but
/// other queries.
class QueryThread {
 public:
  using Report = std::function<void(QueryReport)>;

  /// Opens the database at `path`. `report` is called on the query thread. Throws StorageError.
  QueryThread(const std::string& path, Report report);
  /// Interrupts the query that runs and drops what waits.
  ~QueryThread();
  QueryThread(const QueryThread&) = delete;
  QueryThread& operator=(const QueryThread&) = delete;

  /// False when too many queries wait already.
  bool submit(QueryJob job);

 private:
  void run();
  QueryReport answer(const QueryJob& job);

  Reader reader_;
  Report report_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<QueryJob> queue_;  // guarded by mutex_
  bool stopping_ = false;       // guarded by mutex_
  std::thread thread_;          // last: it uses all the others
};

}  // namespace oblique::server
