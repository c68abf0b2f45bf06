#include "client/service/database_rows.h"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/service/time_guard.h"
#include "server/reading/query_rules.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;

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

DatabaseRows::DatabaseRows(std::string file, server::Reader& reader, protocol::QueryRequest request,
                           const server::QueryLimits& limits, Patience patience)
    : file_(std::move(file)),
      limits_(limits),
      patience_(patience),
      answer_(in_time(limits_, [&] { return reader.answer(request, limits); })) {}

DatabaseRows::~DatabaseRows() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
    wake_.notify_one();
  }
  if (thread_.joinable()) {
    thread_.join();
  }
}

protocol::QueryReply DatabaseRows::next() {
  const std::lock_guard lock(mutex_);
  protocol::QueryReply chunk = in_time(limits_, [this] { return answer_.next(); });
  given_ = Clock::now();
  is_resting_ = false;
  if (!chunk.ends() && !thread_.joinable()) {
    thread_ = std::thread([this] { watch(); });
  }
  return chunk;
}

void DatabaseRows::watch() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, patience_.if_it_can_go_on / 2, [this] { return done_; })) {
    const auto waits = Clock::now() - given_;
    const bool is_in_vain =
        answer_.can_go_on()
            ? waits >= patience_.if_it_can_go_on
            : waits >= patience_.else_after && server::log_bytes(file_) >= patience_.log_bytes;
    if (is_in_vain && !is_resting_) {
      answer_.rest();
      is_resting_ = true;
    }
  }
}

}  // namespace oblique::client
