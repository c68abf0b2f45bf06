#include "proto/recipe/study_size.h"

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "proto/recipe/sampling.h"
#include "worker/solver/model/fall_model.h"

namespace oblique::protocol {
namespace {

/// Average size of a result and of a model in a database (server/store/README.md).
constexpr std::uint64_t kBytesAResult = 970;
constexpr std::uint64_t kBytesAModel = 600;

/// More points than the first are not counted, but estimated from as many random points as the
/// second.
constexpr std::uint64_t kMostCounted = 100'000;
constexpr std::uint64_t kLooks = 10'000;

/// Number of examined points by the hash of their fall.
using MetFalls = std::unordered_map<std::uint64_t, std::uint64_t>;

/// Estimates the number of falls of `points` points after `looks` points were examined, from the
/// numbers of falls that were met once and twice (Chao 1984). At most as many as if each fall that
/// was not met had one point.
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
  constexpr std::uint64_t kTries = 100 * kLooks;
  constexpr std::uint64_t kExamples = 64;
  const std::uint64_t numbers = table.size();
  StudySize size{0, false, table.models(), 0, false, 0, {}};
  for (int i = 0; i < table.recipe().blocks_size(); ++i) {
    const PointsLeftIn left_in = points_left_in(table, static_cast<std::size_t>(i));
    size.points += left_in.points;
    size.points_estimated = size.points_estimated || left_in.estimated;
  }
  size.bytes = kBytesAResult * size.points + kBytesAModel * std::min(size.models, size.points);
  MetFalls met;
  std::uint64_t looks = 0;
  std::optional<std::uint64_t> model;  // of the last point; `fall` is its fall
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
  if (numbers <= kMostCounted) {
    for (std::uint64_t i = 0; (i = table.first_left_in(i, numbers)) < numbers; ++i) {
      look_at(i);
    }
    size.falls = met.size();
    return size;
  }
  for (std::uint64_t i = 0; i < kTries && looks < kLooks; ++i) {
    if (const auto point = sampling::hashed(0, i) % numbers; table.is_left_in(point)) {
      look_at(point);
    }
  }
  if (looks == 0) {
    look_at(0);  // the filter keeps few points or none
  }
  size.falls = estimated_falls(met, static_cast<double>(looks), static_cast<double>(size.points));
  size.falls_estimated = size.falls != met.size();
  return size;
}

PointsLeftIn points_left_in(const PointTable& table, std::size_t block) {
  const BlockPlace& place = table.block(block);
  if (table.recipe().blocks(static_cast<int>(block)).where().empty()) {
    return {place.points, false};
  }
  const bool counts_all = place.points <= kMostCounted;
  const std::uint64_t looks = counts_all ? place.points : kLooks;
  std::uint64_t found = 0;
  for (std::uint64_t look = 0; look < looks; ++look) {
    const std::uint64_t i = counts_all ? look : sampling::hashed(2, look) % place.points;
    found += table.is_left_in(place.first_point + i) ? 1U : 0U;
  }
  const double share = static_cast<double>(found) / static_cast<double>(looks);
  return {
      counts_all ? found : static_cast<std::uint64_t>(share * static_cast<double>(place.points)),
      !counts_all};
}

}  // namespace oblique::protocol
