#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

// What is asked over HTTP, and what is answered.
namespace oblique::server {

/// Since the server began.
struct HttpCounts {
  std::map<unsigned, std::uint64_t> answers;  ///< by status
  std::size_t connections = 0;                ///< that are there
  std::uint64_t ended_as_slow = 0;
  std::uint64_t ended_for_others = 0;
};

/// A request that was let in.
struct HttpQuestion {
  std::uint64_t number;                       ///< of the request; no other has it
  std::string method;                         ///< GET, HEAD or POST
  std::string path;                           ///< without what follows a question mark
  std::map<std::string, std::string> fields;  ///< what follows it, decoded; of two the first
  std::string host;                           ///< as its Host header says
  std::vector<std::string> cookies;           ///< every Cookie header
  std::string known_tag;                      ///< its If-None-Match
  std::string seen_event;                     ///< its Last-Event-ID
  bool takes_gzip = false;
  std::string body;                    ///< of a change, whole
  std::chrono::milliseconds waited{};  ///< since it was asked
  const HttpCounts* counts = nullptr;  ///< never null
};

/// Bytes that go out on a connection for as long as both ends want. Of the server's thread.
class HttpStream {
 public:
  HttpStream() = default;
  virtual ~HttpStream() = default;
  HttpStream(const HttpStream&) = delete;
  HttpStream& operator=(const HttpStream&) = delete;

  /// Whether `next` would give something.
  virtual bool has_news() = 0;
  /// What goes out next; empty: nothing now. Throws nothing.
  virtual std::string next() = 0;
};

struct HttpAnswer {
  unsigned status;
  std::string content_type;
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers = {};  ///< beside those of all answers
  std::shared_ptr<HttpStream> stream = {};  ///< instead of the body, where it is not null
};

/// Returns the answer when it is ready. Called on the HTTP server's thread, again after each wake;
/// destroyed when the answer was returned or the client has disconnected.
using PendingAnswer = std::function<std::optional<HttpAnswer>()>;

}  // namespace oblique::server
