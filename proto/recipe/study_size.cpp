#include "proto/recipe/study_size.h"

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "proto/recipe/sample.h"
#include "worker/solver/model/fall_model.h"

namespace oblique::protocol {
namespace {

/// A result and a model in a database, on average (server/store/README.md).
constexpr std::uint64_t kBytesAResult = 650;
constexpr std::uint64_t kBytesAModel = 600;

/// By the hash of a fall, how many of the points that were looked at have it.
using MetFalls = std::unordered_map<std::uint64_t, std::uint64_t>;

/// Falls of `points` points after `looks`, from the numbers of those met once and twice (Chao
/// 1984), but no more than if each fall that was not met had one point.
std::uint64_t estimated_falls(const MetFalls& met, double looks, double points) {
  double once = 0.0;
  double twice = 0.0;
  for (const auto& [fall, times] : met) {
    once += times == 1 ? 1.0 : 0.0;
    twice += times == 2 ? 1.0 : 0.0;
  }
  const double most = points * once / looks;
  const double unseen = twice > 0.0 ? once * (once - 1.0) / (2.0 * (twice + 1.0)) : most;
  const double all = static_cast<double>(met.size()) + std::min(most, unseen);
  return static_cast<std::uint64_t>(std::min(all, points));
}

}  // namespace

StudySize size_of(const PointTable& table) {
  constexpr std::uint64_t kMostCounted = 100'000;
  constexpr std::uint64_t kMostNumbers = 10'000'000;  // a filter may leave so few in
  constexpr std::uint64_t kLooks = 10'000;
  constexpr std::uint64_t kTries = 100 * kLooks;
  constexpr std::uint64_t kExamples = 64;
  const std::uint64_t numbers = table.size();
  StudySize size{table.points(), table.models(), 0, false, 0, {}};
  size.bytes = kBytesAResult * size.points + kBytesAModel * std::min(size.models, size.points);
  MetFalls met;
  std::uint64_t looks = 0;
  std::optional<std::uint64_t> model;  // of the last point, and its fall
  std::uint64_t fall = 0;
  const auto look_at = [&](std::uint64_t point) {
    if (const auto next = table.point(point).model; next != model) {
      model = next;
      fall = solver::fall_hash(table.model(next));
    }
    ++met[fall];
    ++looks;
    if (size.examples.size() < kExamples) {
      size.examples.push_back(point);
    } else if (const auto place = sampling::hashed(1, looks) % looks; place < kExamples) {
      size.examples[place] = point;
    }
  };
  if (size.points <= kMostCounted && numbers <= kMostNumbers) {
    for (std::uint64_t i = 0; (i = table.first_left_in(i, numbers)) < numbers; ++i) {
      look_at(i);
    }
    size.falls = met.size();
    return size;
  }
  for (std::uint64_t i = 0; i < kTries && looks < kLooks; ++i) {
    const std::uint64_t point = sampling::hashed(0, i) % numbers;
    if (table.is_left_in(point) || i + 1 == kTries) {  // one point at least
      look_at(point);
    }
  }
  size.falls = estimated_falls(met, static_cast<double>(looks), static_cast<double>(size.points));
  size.falls_estimated = size.falls != met.size();
  return size;
}

}  // namespace oblique::protocol
