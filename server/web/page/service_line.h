#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/system/wake_up.h"

namespace oblique::server {

/// The page as a client of the service: requests go from the HTTP server's thread to the loop, and
/// replies back. To the service all tabs are one client, whose shares of traces, queries and long
/// requests they have together.
class ServiceLine {
 public:
  /// By which the service knows this client; no connection is called so.
  static constexpr const char* kIdentity = "the page";

  // ---- Of the HTTP server's thread.
  void ask(std::uint64_t number, protocol::ClientRequest request);
  /// The next reply under that number; nothing: there is none yet.
  std::optional<protocol::ClientReply> reply(std::uint64_t number);
  /// Nothing more is awaited under that number: what is still asked for ends where it can.
  void forget(std::uint64_t number);
  /// The same, but a trace goes on: a browser asks for it again. The first that does takes the
  /// place of those before; where none does the service ends it when its time is over.
  void leave(std::uint64_t number);

  // ---- Of the loop.
  /// Readable when there is something to take.
  int descriptor() const { return woken_.descriptor(); }
  /// Frames of ClientRequest, a few at a time.
  std::vector<std::string> take();
  void put(std::string frame);

 private:
  protocol::WakeUp woken_;
  std::mutex mutex_;
  std::deque<std::string> requests_;  // guarded by mutex_
  std::vector<std::string> frames_;   // guarded by mutex_

  struct Awaited {
    bool is_query = false;   // that has not ended
    std::string trace = {};  // the request for one that has not come; empty: none
    std::deque<protocol::ClientReply> replies = {};
  };
  void send(const protocol::ClientRequest& request);
  void end(std::uint64_t number);
  void end_those_before(const std::string& trace);

  // Of the HTTP server's thread.
  std::map<std::uint64_t, Awaited> awaited_;
  std::deque<std::pair<std::string, std::uint64_t>> left_traces_;  // requests and their numbers
};

}  // namespace oblique::server
