#include "server/web/page/token_file.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <stdexcept>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <spdlog/fmt/fmt.h>

#include "proto/small_file.h"
#include "proto/system/descriptor.h"
#include "proto/text.h"
#include "server/web/page/page_key.h"

namespace oblique::server {
namespace {

constexpr std::size_t kShortest = 32;
constexpr std::size_t kLongest = 128;

[[noreturn]] void throw_wrong(const std::string& path, const std::string& what) {
  throw std::runtime_error(fmt::format("--http-token-file {}: {}", protocol::visible(path), what));
}

std::string new_token(const std::string& path) {
  const protocol::Descriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR));
  const std::string token = PageKey().token();
  const std::string line = token + "\n";
  if (!file.is_open() ||
      ::write(file.number(), line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw_wrong(path, std::strerror(errno));
  }
  return token;
}

}  // namespace

std::string token_of_file(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0 && errno == ENOENT) {
    return new_token(path);
  }
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw_wrong(path, "others may read it: chmod 600 keeps it to its owner");
  }
  std::string token = protocol::read_small_file(path, "the token file", kLongest + 1);
  if (token.ends_with('\n')) {
    token.pop_back();
  }
  const bool is_plain = std::all_of(token.begin(), token.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  });
  if (token.size() < kShortest || token.size() > kLongest || !is_plain) {
    throw_wrong(path, fmt::format("a token has {} to {} letters and digits, on one line", kShortest,
                                  kLongest));
  }
  return token;
}

}  // namespace oblique::server
