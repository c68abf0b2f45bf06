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
#include "proto/system/wake_up.h"
#include "server/web/http/http_message.h"

namespace oblique::server {

/// The HTTP side as one client of the service: requests go to the loop's thread, and replies back.
/// Thread-safe.
class ServiceLine {
 public:
  /// By which the service recognises this client; no connection has this identity.
  static constexpr const char* kIdentity = "the page";

  // ---- Of the HTTP thread and of those that make answers.
  /// A number that no HTTP request has.
  std::uint64_t new_number();
  void ask(std::uint64_t number, protocol::ClientRequest request);
  /// The next reply under that number; nothing if there is none yet.
  std::optional<protocol::ClientReply> reply(std::uint64_t number);
  /// The same, waiting up to `timeout`.
  std::optional<protocol::ClientReply> wait_for_reply(std::uint64_t number,
                                                      std::chrono::milliseconds timeout);
  /// Drops further replies under that number, and ends its query or trace.
  void forget(std::uint64_t number);
  /// The same, but a trace goes on, because a browser requests it again. The first such request
  /// replaces this one; without one the service ends the trace at its deadline.
  void leave(std::uint64_t number);

  // ---- Of the loop's thread.
  /// Readable when there are requests to take.
  int descriptor() const { return woken_.descriptor(); }
  /// Frames of ClientRequest, a few at a time.
  std::vector<std::string> take();
  /// A frame of ClientReply.
  void put(std::string frame);

 private:
  struct Awaited {
    bool is_query = false;   ///< whose answer has not ended
    std::string trace = {};  ///< the request for a trace that has not come; empty: none
    std::deque<protocol::ClientReply> replies = {};
  };
  struct LeftTrace {
    std::string request;
    std::uint64_t number;
  };

  /// Hands the frames that came to those who wait for them. Without mutex_ while it decodes, or the
  /// loop would wait for that.
  void decode_frames();

  // All with mutex_ locked.
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
