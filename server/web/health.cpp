#include "server/web/health.h"

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

constexpr std::int64_t kLongestTurn_ms = 5000;

HttpAnswer sentence(unsigned status, const std::string& text) {
  return {status, "text/plain; charset=utf-8", text + "\n"};
}

constexpr unsigned kOk = 200;
constexpr unsigned kUnavailable = 503;

}  // namespace

HttpAnswer health(std::int64_t turned_ms, std::int64_t now_ms) {
  const std::int64_t age_ms = now_ms - turned_ms;
  if (age_ms <= kLongestTurn_ms) {
    return sentence(kOk, "the server runs");
  }
  const double age_s = 1e-3 * static_cast<double>(age_ms);
  return sentence(kUnavailable, fmt::format("the server's loop has not turned for {} s",
                                            solver::fixed_number(age_s, 1)));
}

HttpAnswer readiness(const Snapshot& snapshot, double free_bytes) {
  if (snapshot.is_stopping) {
    return sentence(kUnavailable, "the server stops and hands out nothing");
  }
  if (!snapshot.database_fault.empty()) {
    return sentence(kUnavailable,
                    "the database takes no results: " + protocol::visible(snapshot.database_fault));
  }
  if (free_bytes < kLeastFree_bytes) {
    return sentence(kUnavailable, fmt::format("the database's disk has {} MB left",
                                              solver::fixed_number(1e-6 * free_bytes, 0)));
  }
  return sentence(kOk, "the server takes work");
}

}  // namespace oblique::server
