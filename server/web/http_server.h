#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "server/web/http_address.h"
#include "server/web/request_rules.h"

namespace oblique::server {

/// What peers can make the HTTP server hold. A connection is for one request.
struct HttpLimits {
  /// When there are so many, the oldest makes room for a new one: of the same address where that
  /// one has its share, else of the address that has the most.
  std::size_t connections = 128;
  std::size_t connections_of_one_address = 32;
  /// A connection's memory for request line, headers and the headers of the answer.
  std::size_t bytes_of_connection = std::size_t{16} * 1024;
  /// From the first byte to the last one of the answer.
  std::chrono::milliseconds longest{10'000};
};

struct HttpAnswer {
  unsigned status;
  std::string content_type;
  std::string body;
};

/// Since the server began.
struct HttpCounts {
  std::map<unsigned, std::uint64_t> answers;  ///< by status
  std::size_t connections = 0;                ///< that are there
  std::uint64_t ended_as_slow = 0;
  std::uint64_t ended_for_others = 0;
};

/// Answers GET and HEAD over HTTP/1.0 and 1.1 on a thread of its own. One that has nothing to say
/// yet lets its connection wait, and nobody else.
class HttpServer {
 public:
  struct Question {
    std::string path;                    ///< without what follows a question mark
    std::chrono::milliseconds waited{};  ///< since it was asked
    const HttpCounts& counts;
  };
  /// Called on the server's thread, and again after each `wake` until there is an answer.
  using Answer = std::function<std::optional<HttpAnswer>(const Question&)>;

  /// Listens from now on. Throws std::runtime_error, naming the address, when it cannot.
  HttpServer(const HttpAddress& address, OwnNames names, const HttpLimits& limits, Answer answer);
  /// Ends the thread; who waits for an answer gets none.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// As http://127.0.0.1:7602, with the port that is really used.
  std::string url() const;
  /// Those who wait are to be asked for again. From any thread; waits for nothing.
  void wake() const;

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace oblique::server
