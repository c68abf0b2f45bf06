#include "server/reading/query_limits.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <system_error>

namespace oblique::server {

QueryLimits limits_of(const protocol::QueryRequest& request) {
  QueryLimits limits;
  if (request.max_rows() > 0) {
    limits.max_rows = std::min(limits.max_rows, request.max_rows());
  }
  if (request.time_limit_ms() > 0) {
    limits.time_limit_ms = static_cast<std::int64_t>(std::min<std::uint64_t>(
        request.time_limit_ms(), static_cast<std::uint64_t>(kLongestTimeLimit_ms)));
  }
  return limits;
}

std::uint64_t log_bytes(const std::string& path) {
  std::error_code none;
  const auto bytes = std::filesystem::file_size(path + "-wal", none);
  return none ? 0 : static_cast<std::uint64_t>(bytes);
}

std::string took_too_long(std::int64_t time_limit_ms) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(),
                                 static_cast<double>(time_limit_ms) / 1000.0)
                       .ptr;
  return "the query took too long (more than " + std::string(text.data(), end) +
         " s): narrow it, as with WHERE or LIMIT, or give it more time with --timeout";
}

}  // namespace oblique::server
