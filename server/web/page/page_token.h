#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace oblique::server {

/// Lets a browser in: a token, which people get with the address of the page, is exchanged for a
/// cookie that no script and no other site can use. Either gives the rights of a client.
class PageToken {
 public:
  /// Draws a token of 256 bits.
  PageToken();
  /// A given token. The cookie follows from it, so that it outlasts a restart.
  explicit PageToken(std::string token);
  /// The token in a file that only its owner may read; made with a drawn token if there is none.
  /// Throws std::runtime_error that names the file and what is wrong.
  static PageToken from_file(const std::string& path);

  const std::string& text() const { return text_; }
  bool is(std::string_view text) const;
  /// The value of a Set-Cookie header. `host` is the Host header: its port is part of the cookie's
  /// name, because browsers send a cookie to all ports.
  std::string cookie_for(const std::string& host) const;
  /// Whether one of these Cookie headers has the cookie.
  bool is_in(const std::vector<std::string>& cookies, const std::string& host) const;

 private:
  std::string text_;
  std::string cookie_;
};

}  // namespace oblique::server
