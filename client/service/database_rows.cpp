#include "client/service/database_rows.h"

#include <chrono>

#include <spdlog/fmt/fmt.h>

#include "client/service/time_guard.h"
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

/// Gives what `make` gives, unless it takes too long.
template <typename Make>
auto in_time(const server::QueryLimits& limits, const Make& make) {
  // Some functions of SQL do not look at the clock.
  constexpr std::chrono::milliseconds kGrace{500};
  const TimeGuard guard(std::chrono::milliseconds(limits.time_limit_ms) + kGrace,
                        fmt::format("oblique: {}", server::took_too_long(limits.time_limit_ms)));
  try {
    return make();
  } catch (const server::StatementError& error) {
    throw solver::InputError(error.what());
  }
}

}  // namespace

DatabaseRows::DatabaseRows(server::Reader& reader, const protocol::QueryRequest& request,
                           const server::QueryLimits& limits)
    : limits_(limits), answer_(in_time(limits_, [&] { return reader.answer(request, limits); })) {}

protocol::QueryReply DatabaseRows::next() {
  return in_time(limits_, [this] { return answer_.next(); });
}

}  // namespace oblique::client
