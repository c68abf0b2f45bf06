#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace oblique::server {

/// What lets a browser in: a token that people get with the address of the page, once exchanged for
/// a cookie that no script and no other site can use. Whoever has one of them has a client's right.
class PageKey {
 public:
  /// Draws a token of 256 bits.
  PageKey();
  /// Of a token that was given; the cookie follows from it, so that it outlasts a restart.
  explicit PageKey(std::string token);

  const std::string& token() const { return token_; }
  bool is_token(std::string_view text) const;
  /// For a Set-Cookie header. Cookies do not know ports, so that it has its port in its name: that
  /// of `host`, the Host header of the browser.
  std::string cookie_for(const std::string& host) const;
  /// Whether one of these Cookie headers has it.
  bool is_in(const std::vector<std::string>& cookies, const std::string& host) const;

 private:
  std::string token_;
  std::string cookie_;
};

}  // namespace oblique::server
