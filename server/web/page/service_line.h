#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/system/wake_up.h"

namespace oblique::server {

/// The page as a client of the service: requests go from the HTTP server's thread to the loop, and
/// replies back. To the service all tabs are one client, whose shares of traces, queries and long
/// requests they have together; those of strangers, who come without the token, are another one, so
/// that they take nothing of these shares.
class ServiceLine {
 public:
  /// By which the service knows these clients; no connection is called so.
  static constexpr const char* kIdentity = "the page";
  static constexpr const char* kStrangers = "the page without its token";

  /// A frame of ClientRequest, and whose it is.
  struct Request {
    const char* client;
    std::string frame;
  };

  // ---- Of the HTTP server's thread.
  /// Whose it is, the first request under a number says for all that follow.
  void ask(std::uint64_t number, protocol::ClientRequest request, bool is_strangers = false);
  /// Whether a stranger's request is under way under that number.
  bool is_strangers(std::uint64_t number) const;
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
  /// A few at a time.
  std::vector<Request> take();
  void put(std::string frame);

 private:
  protocol::WakeUp woken_;
  std::mutex mutex_;
  std::deque<Request> requests_;     // guarded by mutex_
  std::vector<std::string> frames_;  // guarded by mutex_

  struct Awaited {
    bool is_strangers = false;
    bool is_query = false;   // that has not ended
    std::string trace = {};  // the request for one that has not come; empty: none
    std::deque<protocol::ClientReply> replies = {};
  };
  void send(const protocol::ClientRequest& request, bool is_strangers);
  void end(std::uint64_t number, bool is_strangers);
  void end_those_before(const std::string& trace);

  // Of the HTTP server's thread.
  struct LeftTrace {
    std::string request;
    std::uint64_t number;
    bool is_strangers;
  };
  std::map<std::uint64_t, Awaited> awaited_;
  std::deque<LeftTrace> left_traces_;
};

}  // namespace oblique::server
