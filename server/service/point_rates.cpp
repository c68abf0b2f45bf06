#include "server/service/point_rates.h"

#include <algorithm>
#include <iterator>

namespace oblique::server {
namespace {

constexpr std::int64_t kRateSpan_ms = 5000;

}  // namespace

void PointRates::begin(Id id, std::uint64_t count, std::int64_t since_ms, std::int64_t now_ms) {
  auto& samples = samples_[id];
  if (samples.empty()) {
    samples.push_back({std::max(since_ms, now_ms - kRateSpan_ms), count});
  }
}

void PointRates::sample(const Count& count, std::int64_t now_ms) {
  for (auto entry = samples_.begin(); entry != samples_.end();) {
    auto& samples = entry->second;
    samples.push_back({now_ms, count(entry->first)});
    while (now_ms - samples[1].at_ms >= kRateSpan_ms) {
      samples.pop_front();
    }
    const bool rests = samples.front().count == samples.back().count;
    entry = rests ? samples_.erase(entry) : std::next(entry);
  }
}

double PointRates::points_per_s(Id id, std::uint64_t count, std::int64_t now_ms) const {
  const auto found = samples_.find(id);
  if (found == samples_.end() || now_ms <= found->second.front().at_ms) {
    return 0.0;
  }
  const Sample& oldest = found->second.front();
  return 1000.0 * (static_cast<double>(count) - static_cast<double>(oldest.count)) /
         static_cast<double>(now_ms - oldest.at_ms);
}

double PointRates::points_per_s(const Count& count, std::int64_t now_ms) const {
  double sum = 0.0;
  for (const auto& [id, samples] : samples_) {
    sum += points_per_s(id, count(id), now_ms);
  }
  return sum;
}

}  // namespace oblique::server
