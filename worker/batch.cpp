#include "worker/batch.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace oblique::worker {

Batch::Batch(std::uint64_t number, std::uint64_t study_id, const std::vector<Range>& ranges,
             std::shared_ptr<const protocol::PointTable> points, std::uint32_t attempt,
             std::string study_uid)
    : number_(number),
      study_id_(study_id),
      study_uid_(std::move(study_uid)),
      points_(std::move(points)),
      attempt_(attempt) {
  for (const Range& range : ranges) {
    runs_.push_back({size_, range.begin});
    size_ += range.end - range.begin;
  }
}

Batch::Range Batch::points_from(std::uint64_t position, std::uint64_t end) const {
  const auto next =
      std::upper_bound(runs_.begin(), runs_.end(), position,
                       [](std::uint64_t at, const Run& run) { return at < run.position; });
  const Run& run = *std::prev(next);
  const std::uint64_t first = run.point + (position - run.position);
  return {first, first + std::min(end, next == runs_.end() ? size_ : next->position) - position};
}

std::uint64_t Batch::first_to_solve(std::uint64_t at, std::uint64_t end) const {
  while (points_->has_filter() && at < end) {
    const auto [first, past] = points_from(at, end);
    const std::uint64_t found = points_->first_passing(first, past);
    at += found - first;
    if (found < past) {
      break;
    }
  }
  return at;
}

void Batch::append_points(std::uint64_t begin, std::uint64_t end,
                          std::vector<Range>& ranges) const {
  while (begin < end) {
    const Range points = points_from(begin, end);
    begin += points.end - points.begin;
    if (!ranges.empty() && ranges.back().end == points.begin) {
      ranges.back().end = points.end;
    } else {
      ranges.push_back(points);
    }
  }
}

std::uint64_t Batch::end_of_model(std::uint64_t position) const {
  const auto [first, past] = points_from(position, size_);
  const protocol::Segment segment = points_->segment_at(first);
  return position + std::min(segment.first_point + segment.count, past) - first;
}

std::optional<std::vector<Batch::Range>> ranges_of(const protocol::Batch& message,
                                                   std::uint64_t study_points) {
  std::vector<Batch::Range> ranges;
  std::uint64_t reached = 0;
  std::uint64_t left = study_points;
  for (int i = 0; i + 1 < message.ranges_size(); i += 2) {
    const std::uint64_t begin = reached + static_cast<std::uint64_t>(message.ranges(i));
    const auto count = static_cast<std::uint64_t>(message.ranges(i + 1));
    if (begin >= study_points || count == 0 || count > left || count > study_points - begin) {
      return std::nullopt;
    }
    ranges.push_back({begin, begin + count});
    reached = begin + count;
    left -= count;
  }
  return ranges.empty() || message.ranges_size() % 2 != 0 ? std::nullopt
                                                          : std::optional(std::move(ranges));
}

}  // namespace oblique::worker
