#include "worker/leaving.h"

#include <algorithm>
#include <cmath>

namespace oblique::worker {
namespace {

/// Weight of the newest measurement.
constexpr double kPaceWeight = 0.5;
/// Of the paces that are known few are kept: studies come and go.
constexpr std::size_t kMostStudies = 64;

}  // namespace

Leaving::Leaving(const LeavingSettings& settings, std::size_t threads)
    : settings_(settings), threads_(static_cast<double>(std::max<std::size_t>(threads, 1))) {}

void Leaving::note_solved(const HeldPoints& solved, double busy_s) {
  if (solved.points == 0 || !std::isfinite(busy_s) || busy_s <= 0.0) {
    return;
  }
  const double s_per_point = busy_s / static_cast<double>(solved.points);
  const auto [known, is_new] = s_per_point_.try_emplace(solved.study_id, s_per_point);
  known->second += is_new ? 0.0 : kPaceWeight * (s_per_point - known->second);
  if (s_per_point_.size() > kMostStudies) {
    s_per_point_.erase(s_per_point_.begin()->first == solved.study_id
                           ? std::next(s_per_point_.begin())
                           : s_per_point_.begin());
  }
}

/// 0 where nothing is known.
double Leaving::takes_ms(const HeldPoints& held) const {
  const auto known = s_per_point_.find(held.study_id);
  if (known == s_per_point_.end()) {
    return 0.0;
  }
  constexpr double kMillisecondsASecond = 1000.0;
  const double rounds = std::ceil(static_cast<double>(held.points) / threads_);
  return kMillisecondsASecond * rounds * known->second;
}

std::size_t Leaving::ending_in_time(std::span<const HeldPoints> held, std::int64_t now_ms) const {
  if (settings_.until_ms == kNever_ms) {
    return held.size();
  }
  double left_ms = static_cast<double>(settings_.until_ms - farewell_ms() - now_ms);
  std::size_t count = 0;
  for (const HeldPoints& part : held) {
    left_ms -= takes_ms(part);
    if (left_ms < 0.0) {
      break;
    }
    ++count;
  }
  return count;
}

bool Leaving::has_time_for_more(std::span<const HeldPoints> held, std::int64_t now_ms) const {
  if (settings_.until_ms == kNever_ms || !last_batch_) {
    return true;
  }
  double left_ms = static_cast<double>(settings_.until_ms - farewell_ms() - now_ms);
  for (const HeldPoints& part : held) {
    left_ms -= takes_ms(part);
  }
  return left_ms >= takes_ms(*last_batch_);
}

std::int64_t Leaving::next_deadline_ms() const {
  const std::int64_t idle_ms =
      settings_.idle_exit_ms == kNever_ms ? kNever_ms : last_work_ms_ + settings_.idle_exit_ms;
  return std::min(settings_.until_ms - farewell_ms(), idle_ms);
}

}  // namespace oblique::worker
