#include "server/web/page/page_key.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <sodium/randombytes.h>
#include <sodium/utils.h>

#include "proto/recipe/model_message.h"

namespace oblique::server {
namespace {

std::string drawn_token() {
  std::string bytes(32, '\0');
  randombytes_buf(bytes.data(), bytes.size());
  return protocol::sha256_of(bytes);
}

std::string cookie_of(const std::string& token) {
  return protocol::sha256_of("oblique's page: the cookie of this token\n" + token);
}

/// In a time that does not tell how many characters are right.
bool is_same(std::string_view one, std::string_view other) {
  return one.size() == other.size() && sodium_memcmp(one.data(), other.data(), one.size()) == 0;
}

std::string name_for(const std::string& host) {
  const std::size_t colon = host.rfind(':');
  const bool has_port = colon != std::string::npos && host.find(']', colon) == std::string::npos;
  return "oblique-" + (has_port ? host.substr(colon + 1) : "80");
}

}  // namespace

PageKey::PageKey() : PageKey(drawn_token()) {}

PageKey::PageKey(std::string token) : token_(std::move(token)), cookie_(cookie_of(token_)) {}

bool PageKey::is_token(std::string_view text) const {
  return is_same(text, token_);
}

std::string PageKey::cookie_for(const std::string& host) const {
  return name_for(host) + "=" + cookie_ + "; Path=/; HttpOnly; SameSite=Strict";
}

bool PageKey::is_in(const std::vector<std::string>& cookies, const std::string& host) const {
  const std::string name = name_for(host) + "=";
  for (std::string_view header : cookies) {
    while (!header.empty()) {
      const std::string_view one = header.substr(0, header.find(';'));
      header.remove_prefix(std::min(header.size(), one.size() + 1));
      const std::size_t begin = std::min(one.find_first_not_of(' '), one.size());
      const std::string_view pair = one.substr(begin);
      if (pair.starts_with(name) && is_same(pair.substr(name.size()), cookie_)) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace oblique::server
