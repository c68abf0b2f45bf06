#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sodium/randombytes.h>
#include <sodium/utils.h>
#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "proto/small_file.h"
#include "proto/system/descriptor.h"
#include "proto/text.h"
#include "server/web/page/page.h"

namespace oblique::server {
namespace {

constexpr std::size_t kShortest = 32;
constexpr std::size_t kLongest = 128;

std::string drawn_token() {
  std::string bytes(32, '\0');
  randombytes_buf(bytes.data(), bytes.size());
  return protocol::sha256_of(bytes);
}

/// Compares two texts in a time that does not depend on the number of equal characters.
bool is_same(std::string_view one, std::string_view other) {
  return one.size() == other.size() && sodium_memcmp(one.data(), other.data(), one.size()) == 0;
}

std::string cookie_name(const std::string& host) {
  const std::size_t colon = host.rfind(':');
  const bool has_port = colon != std::string::npos && host.find(']', colon) == std::string::npos;
  return "oblique-" + (has_port ? host.substr(colon + 1) : "80");
}

[[noreturn]] void throw_wrong(const std::string& path, const std::string& what) {
  throw std::runtime_error(fmt::format("--http-token-file {}: {}", protocol::visible(path), what));
}

PageToken write_new_token(const std::string& path) {
  const protocol::Descriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR));
  PageToken token;
  const std::string line = token.text() + "\n";
  if (!file.is_open() ||
      ::write(file.number(), line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw_wrong(path, std::strerror(errno));
  }
  return token;
}

}  // namespace

PageToken::PageToken() : PageToken(drawn_token()) {}

PageToken::PageToken(std::string token)
    : text_(std::move(token)),
      cookie_(protocol::sha256_of("oblique's page: the cookie of this token\n" + text_)) {}

PageToken PageToken::from_file(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0 && errno == ENOENT) {
    return write_new_token(path);
  }
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw_wrong(path, "others may read it: use chmod 600");
  }
  std::string token = protocol::read_small_file(path, "the token file", kLongest + 1);
  if (token.ends_with('\n')) {
    token.pop_back();
  }
  const bool is_plain = std::all_of(token.begin(), token.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  });
  if (token.size() < kShortest || token.size() > kLongest || !is_plain) {
    throw_wrong(path, fmt::format("a token must have {} to {} letters and digits, on one line",
                                  kShortest, kLongest));
  }
  return PageToken(std::move(token));
}

bool PageToken::is(std::string_view text) const {
  return is_same(text, text_);
}

std::string PageToken::cookie_for(const std::string& host) const {
  return cookie_name(host) + "=" + cookie_ + "; HttpOnly; SameSite=Strict";
}

bool PageToken::is_in(const std::vector<std::string>& cookies, const std::string& host) const {
  const std::string name = cookie_name(host) + "=";
  for (std::string_view header : cookies) {
    while (!header.empty()) {
      const std::string_view one = header.substr(0, header.find(';'));
      header.remove_prefix(std::min(header.size(), one.size() + 1));
      const std::string_view pair = one.substr(std::min(one.find_first_not_of(' '), one.size()));
      if (pair.starts_with(name) && is_same(pair.substr(name.size()), cookie_)) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace oblique::server
