#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

#include <poll.h>

#include "tests/support/raw_tcp.h"

namespace oblique::server {

/// A TCP connection to an HTTP server on 127.0.0.1, byte by byte.
class RawHttp : public test::RawTcp {
 public:
  using RawTcp::RawTcp;

  /// False if the server accepts no more.
  bool send(const std::string& bytes) { return send_all(bytes); }
  /// Receives until these bytes have arrived; later bytes wait.
  std::string read_until(const std::string& end) {
    std::string all;
    while (!all.ends_with(end)) {
      const std::string one = receive(0, 1);
      if (one.empty()) {
        throw std::runtime_error("the server says no more than: " + all);
      }
      all += one;
    }
    return all;
  }
  std::string ask(const std::string& bytes) {
    send(bytes);
    return read_to_the_end();
  }
  /// Whether the server has sent something or ended the connection.
  bool has_news() const {
    pollfd item{number(), POLLIN, 0};
    return ::poll(&item, 1, 0) == 1;
  }
};

inline std::string get(const std::string& url, const std::string& path) {
  return RawHttp(url).ask("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
}

/// The status; 0 without an answer.
inline int status_of_answer(const std::string& answer) {
  return answer.starts_with("HTTP/1.") ? std::stoi(answer.substr(answer.find(' ') + 1)) : 0;
}

/// The body, of which chunks are joined.
inline std::string body_of(const std::string& answer) {
  const auto head = answer.find("\r\n\r\n");
  std::string rest = head == std::string::npos ? "" : answer.substr(head + 4);
  if (answer.substr(0, head).find("Transfer-Encoding: chunked") == std::string::npos) {
    return rest;
  }
  std::string body;
  while (!rest.empty()) {
    const std::size_t bytes = std::stoull(rest, nullptr, 16);
    body += rest.substr(rest.find("\r\n") + 2, bytes);
    rest = bytes == 0 ? "" : rest.substr(rest.find("\r\n") + 2 + bytes + 2);
  }
  return body;
}

}  // namespace oblique::server
