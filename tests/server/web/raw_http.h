#pragma once

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include "proto/system/descriptor.h"
#include "tests/support/hang_limit.h"

namespace oblique::server {

/// A TCP connection to an HTTP server on 127.0.0.1, byte by byte.
class RawHttp {
 public:
  /// `url` as http://127.0.0.1:7602; `from` is the address that the server sees.
  explicit RawHttp(const std::string& url, const std::string& from = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const auto port = static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1)));
    const sockaddr_in own = address_of(from, 0);
    const sockaddr_in other = address_of("127.0.0.1", port);
    if (::bind(number(), reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0 ||
        ::connect(number(), reinterpret_cast<const sockaddr*>(&other), sizeof other) != 0) {
      throw std::runtime_error(std::string("cannot connect: ") + std::strerror(errno));
    }
  }

  /// False when the server takes no more.
  bool send(const std::string& bytes) {
    std::size_t sent = 0;
    while (sent < bytes.size()) {
      const auto count = ::send(number(), bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count < 0) {
        return false;
      }
      sent += static_cast<std::size_t>(count);
    }
    return true;
  }
  /// All that comes until the server ends the connection.
  std::string read_to_the_end() {
    std::string all;
    std::string some(std::size_t{64} * 1024, '\0');
    while (true) {
      pollfd item{number(), POLLIN, 0};
      if (::poll(&item, 1, kLongest_ms) != 1) {
        throw std::runtime_error("the server neither answers nor ends the connection");
      }
      const auto count = ::recv(number(), some.data(), some.size(), 0);
      if (count <= 0) {
        return all;
      }
      all.append(some, 0, static_cast<std::size_t>(count));
    }
  }
  /// What comes until those bytes have; what follows them waits.
  std::string read_until(const std::string& end) {
    std::string all;
    char one = 0;
    while (!all.ends_with(end)) {
      pollfd item{number(), POLLIN, 0};
      if (::poll(&item, 1, kLongest_ms) != 1 || ::recv(number(), &one, 1, 0) != 1) {
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
  /// The server has said something, or ended the connection.
  bool has_news() const {
    pollfd item{number(), POLLIN, 0};
    return ::poll(&item, 1, 0) == 1;
  }
  int number() const { return socket_.number(); }

 private:
  static constexpr int kLongest_ms = std::chrono::milliseconds(test::kHangLimit).count();

  static sockaddr_in address_of(const std::string& text, std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    inet_pton(AF_INET, text.c_str(), &address.sin_addr);
    return address;
  }

  protocol::Descriptor socket_;
};

inline std::string get(const std::string& url, const std::string& path) {
  return RawHttp(url).ask("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
}

/// 0 where there is no answer.
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
