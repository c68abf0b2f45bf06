#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/web/http/http_address.h"
#include "server/web/http/http_message.h"
#include "server/web/http/request_rules.h"

namespace oblique::server {

/// What peers can make the HTTP server hold. A connection is for one request.
struct HttpLimits {
  /// When there are so many, the oldest makes room for a new one: of the same address where that
  /// one has its share, else of the address that has the most.
  std::size_t connections = 128;
  std::size_t connections_of_one_address = 32;
  /// A connection's memory for request line, headers and the headers of the answer.
  std::size_t bytes_of_connection = std::size_t{16} * 1024;
  /// From the first byte to the last one of the answer. Of a stream: for its peer to take what is
  /// there.
  std::chrono::milliseconds longest{10'000};
  /// That go on for as long as both ends want, beside the connections above.
  std::size_t streams = 32;
};

/// Answers GET, HEAD, and changes by POST, over HTTP/1.0 and 1.1 on a thread of its own. One that
/// has nothing to say yet lets its connection wait, and nobody else.
class HttpServer {
 public:
  using Question = HttpQuestion;
  /// Called on the server's thread, and again after each `wake` until there is an answer.
  using Answer = std::function<std::optional<HttpAnswer>(const Question&)>;

  /// What else the server asks whom it serves, on its thread.
  struct Rules {
    /// Whether something can be changed at that path, by POST.
    std::function<bool(const std::string& path)> takes_changes = [](const std::string&) {
      return false;
    };
    /// Why a change is refused, asked before its body is read.
    std::function<std::optional<HttpAnswer>(const Question&)> objection = [](const Question&) {
      return std::nullopt;
    };
    /// Nobody waits for the answer to the request of that number any more.
    std::function<void(std::uint64_t number)> gone = [](std::uint64_t) {};
    /// Called whenever the thread turns; gives the time after which it is to turn again.
    std::function<std::optional<std::chrono::milliseconds>()> turn =
        []() -> std::optional<std::chrono::milliseconds> { return std::nullopt; };
    /// The time of connections; tests set their own.
    std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
  };

  /// Listens from now on. Throws std::runtime_error, naming the address, when it cannot.
  HttpServer(const HttpAddress& address, OwnNames names, const HttpLimits& limits, Answer answer)
      : HttpServer(address, std::move(names), limits, std::move(answer), Rules()) {}
  HttpServer(const HttpAddress& address, OwnNames names, const HttpLimits& limits, Answer answer,
             Rules rules);
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
