#include "worker/batch.h"

#include <algorithm>

namespace oblique::worker {

std::uint64_t Batch::first_to_solve(std::uint64_t at, std::uint64_t end) const {
  while ((at = points->first_left_in(at, end)) < end && !parts.empty()) {
    const auto part = std::upper_bound(
        parts.begin(), parts.end(), at,
        [](std::uint64_t point, const BatchPart& other) { return point < other.end; });
    if (part == parts.end()) {
      return end;
    }
    if (part->begin <= at) {
      return at;
    }
    at = std::min(part->begin, end);
  }
  return at;
}

std::optional<std::vector<BatchPart>> parts_of(const protocol::Batch& message) {
  std::vector<BatchPart> parts;
  std::uint64_t at = message.first_point();
  std::uint64_t left = message.count();
  bool is_wanted = false;
  for (const std::uint64_t points : message.parts()) {
    if (points == 0 || points > left) {
      return std::nullopt;
    }
    is_wanted = !is_wanted;
    if (is_wanted) {
      parts.push_back({at, at + points});
    }
    at += points;
    left -= points;
  }
  return message.parts().empty() || (left == 0 && is_wanted) ? std::optional(std::move(parts))
                                                             : std::nullopt;
}

std::uint64_t points_to_solve(const Batch& batch) {
  constexpr std::uint64_t kMostLooks = 100'000;
  if (!batch.points->has_filter() || batch.count > kMostLooks) {
    std::uint64_t points = batch.parts.empty() ? batch.count : 0;
    for (const BatchPart& part : batch.parts) {
      points += part.end - part.begin;
    }
    return points;
  }
  std::uint64_t points = 0;
  const std::uint64_t end = batch.first_point + batch.count;
  for (std::uint64_t at = batch.first_to_solve(batch.first_point, end); at < end;
       at = batch.first_to_solve(at + 1, end)) {
    ++points;
  }
  return points;
}

}  // namespace oblique::worker
