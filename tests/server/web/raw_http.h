#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

#include <poll.h>

#include "tests/support/raw_tcp.h"

namespace oblique::server {

/// A TCP connection to an HTTP server on 127.0.0.1, on which tests can send any bytes.
class RawHttp : public test::RawTcp {
 public:
  using RawTcp::RawTcp;

  /// Sends all bytes; returns false if the server has closed the connection.
  bool send(const std::string& bytes) { return send_all(bytes); }
  /// Receives bytes up to and including `end`; later bytes stay in the socket.
  std::string read_until(const std::string& end) {
    std::string all;
    while (!all.ends_with(end)) {
      const std::string one = receive(0, 1);
      if (one.empty()) {
        throw std::runtime_error("the connection ended after: " + all);
      }
      all += one;
    }
    return all;
  }
  std::string exchange(const std::string& bytes) {
    send(bytes);
    return read_to_the_end();
  }
  /// Returns true if the server has sent something or ended the connection.
  bool has_news() const {
    pollfd item{number(), POLLIN, 0};
    return ::poll(&item, 1, 0) == 1;
  }
};

inline std::string get(const std::string& url, const std::string& path) {
  return RawHttp(url).exchange("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
}

/// Returns the status of an HTTP answer, or 0 if the text is no answer.
inline int status_of_answer(const std::string& answer) {
  return answer.starts_with("HTTP/1.") ? std::stoi(answer.substr(answer.find(' ') + 1)) : 0;
}

/// Returns the body of an HTTP answer; joins its chunks.
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
