#include "server/service/counts/settled_rates.h"

#include <algorithm>
#include <iterator>

namespace oblique::server {
namespace {

/// Rates are taken over so long, or as long as the study is known.
constexpr std::int64_t kSpan_ms = 5000;

}  // namespace

void SettledRates::note(StudyId study, std::uint64_t settled, std::int64_t since_ms,
                        std::int64_t now_ms) {
  auto& samples = samples_[study];
  if (samples.empty()) {
    samples.push_back({std::max(since_ms, now_ms - kSpan_ms), settled});
  }
}

void SettledRates::sample(const std::function<std::uint64_t(StudyId)>& settled,
                          std::int64_t now_ms) {
  for (auto entry = samples_.begin(); entry != samples_.end();) {
    auto& samples = entry->second;
    samples.push_back({now_ms, settled(entry->first)});
    while (now_ms - samples[1].at_ms >= kSpan_ms) {
      samples.pop_front();
    }
    const bool rests = samples.front().settled == samples.back().settled;
    entry = rests ? samples_.erase(entry) : std::next(entry);
  }
}

double SettledRates::points_per_s(StudyId study, std::uint64_t settled, std::int64_t now_ms) const {
  const auto found = samples_.find(study);
  if (found == samples_.end() || now_ms <= found->second.front().at_ms) {
    return 0.0;
  }
  const Sample& oldest = found->second.front();
  return 1000.0 * (static_cast<double>(settled) - static_cast<double>(oldest.settled)) /
         static_cast<double>(now_ms - oldest.at_ms);
}

double SettledRates::points_per_s(const std::function<std::uint64_t(StudyId)>& settled,
                                  std::int64_t now_ms) const {
  double sum = 0.0;
  for (const auto& [study, samples] : samples_) {
    sum += points_per_s(study, settled(study), now_ms);
  }
  return sum;
}

}  // namespace oblique::server
