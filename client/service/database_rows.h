#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "client/service/source.h"
#include "server/reading/reader.h"

namespace oblique::client {

/// When an answer of which nothing is taken, as when its rows go to a pager, ends its transaction.
struct Patience {
  std::chrono::milliseconds if_it_can_go_on{1'000};
  std::chrono::milliseconds else_after{10'000};  ///< and with a log that has grown so long:
  std::uint64_t log_bytes = server::kLongLogBytes;
};

/// An answer from a database file. A chunk that takes longer than the time limit is an error; one
/// that cannot be stopped then ends the program soon after.
///
/// While a transaction is open, the database cannot empty its write-ahead log. So one that comes in
/// the order of its points ends it when nobody takes the next chunk, and goes on later. Any other
/// is ended, and the next chunk is an error, but only once the log has grown long.
class DatabaseRows : public RowStream {
 public:
  DatabaseRows(std::string file, server::Reader& reader, protocol::QueryRequest request,
               const server::QueryLimits& limits, Patience patience = {});
  ~DatabaseRows() override;
  DatabaseRows(const DatabaseRows&) = delete;
  DatabaseRows& operator=(const DatabaseRows&) = delete;

  protocol::QueryReply next() override;

 private:
  void watch();

  const std::string file_;
  const server::QueryLimits limits_;
  const Patience patience_;
  std::mutex mutex_;
  std::condition_variable wake_;
  server::Answer answer_;                        // guarded by mutex_
  std::chrono::steady_clock::time_point given_;  // the last chunk; guarded by mutex_
  bool is_resting_ = false;                      // guarded by mutex_
  bool done_ = false;                            // guarded by mutex_
  std::thread thread_;                           // of a long answer; last: it uses all the others
};

}  // namespace oblique::client
