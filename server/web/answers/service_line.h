#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/system/descriptor.h"
#include "server/web/http/http_message.h"

namespace oblique::server {

/// The HTTP side as one client of the service: requests go to the loop's thread, and replies back.
/// Thread-safe.
class ServiceLine {
 public:
  /// The identity of this client for the service; no connection has it.
  static constexpr const char* kIdentity = "the page";

  // ---- Called by the HTTP thread and by threads that make answers.
  /// A new request number, different from those of HTTP requests.
  std::uint64_t new_number();
  void ask(std::uint64_t number, protocol::ClientRequest request);
  /// The next reply to request `number`; none if there is none yet.
  std::optional<protocol::ClientReply> reply(std::uint64_t number);
  /// The same, but waits up to `timeout`.
  std::optional<protocol::ClientReply> wait_for_reply(std::uint64_t number,
                                                      std::chrono::milliseconds timeout);
  /// Drops further replies to request `number`, and ends its query or trace.
  void forget(std::uint64_t number);
  /// The same, but a trace continues, because the browser may request it again. Such a request
  /// takes the trace over; without one the service ends it at its deadline.
  void leave(std::uint64_t number);

  // ---- Called by the loop's thread.
  /// Readable when there are requests to take.
  int descriptor() const { return woken_.descriptor(); }
  /// The next few frames of ClientRequest.
  std::vector<std::string> take();
  /// Adds a received frame of ClientReply.
  void put(std::string frame);

 private:
  struct Awaited {
    bool is_query = false;   ///< a query whose answer has not ended
    std::string trace = {};  ///< the request for a trace that is not complete; empty: none
    std::deque<protocol::ClientReply> replies = {};
  };
  struct LeftTrace {
    std::string request;
    std::uint64_t number;
  };

  /// Decodes received frames and adds them to the replies. mutex_ is not locked while it decodes,
  /// so that the loop need not wait.
  void decode_frames();

  // Called with mutex_ locked.
  std::optional<protocol::ClientReply> next_reply(std::uint64_t number);
  void drop(std::uint64_t number);
  void end(std::uint64_t number);
  void send(protocol::ClientRequest request);

  protocol::WakeUp woken_;
  std::mutex decoding_mutex_;  ///< locked before mutex_; keeps the chunks of an answer in order
  std::mutex mutex_;
  std::condition_variable replied_;
  std::uint64_t last_number_ = std::uint64_t{1} << 63U;  // guarded by mutex_
  std::deque<std::string> requests_;                     // guarded by mutex_
  std::vector<std::string> frames_;                      // guarded by mutex_
  std::map<std::uint64_t, Awaited> awaited_;             // guarded by mutex_
  std::deque<LeftTrace> left_traces_;                    // guarded by mutex_
};

/// The HTTP answer to an error of the service.
HttpAnswer failure(const protocol::ErrorReply& error);

}  // namespace oblique::server
