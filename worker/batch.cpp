#include "worker/batch.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace oblique::worker {

Batch::Batch(std::uint64_t number, std::uint64_t study_id, const std::vector<Range>& ranges,
             std::shared_ptr<const protocol::PointTable> points)
    : number_(number), study_id_(study_id), points_(std::move(points)) {
  for (const Range& range : ranges) {
    runs_.push_back({size_, range.begin});
    size_ += range.end - range.begin;
  }
}

std::size_t Batch::run_of(std::uint64_t position) const {
  const auto after =
      std::upper_bound(runs_.begin(), runs_.end(), position,
                       [](std::uint64_t at, const Run& run) { return at < run.position; });
  return static_cast<std::size_t>(std::distance(runs_.begin(), after)) - 1;
}

std::uint64_t Batch::end_of_run(std::size_t run) const {
  return run + 1 < runs_.size() ? runs_[run + 1].position : size_;
}

std::uint64_t Batch::point_at(std::uint64_t position) const {
  const Run& run = runs_[run_of(position)];
  return run.point + (position - run.position);
}

std::uint64_t Batch::first_to_solve(std::uint64_t at, std::uint64_t end) const {
  if (!points_->has_filter()) {
    return at;
  }
  while (at < end) {
    const std::uint64_t run_end = std::min(end_of_run(run_of(at)), end);
    const std::uint64_t first = point_at(at);
    const std::uint64_t past = first + (run_end - at);
    const std::uint64_t found = points_->first_passing(first, past);
    if (found < past) {
      return at + (found - first);
    }
    at = run_end;
  }
  return end;
}

void Batch::append_points(std::uint64_t begin, std::uint64_t end,
                          std::vector<Range>& ranges) const {
  while (begin < end) {
    const std::uint64_t run_end = std::min(end_of_run(run_of(begin)), end);
    const std::uint64_t first = point_at(begin);
    if (ranges.empty() || ranges.back().end != first) {
      ranges.push_back({first, first});
    }
    ranges.back().end = first + (run_end - begin);
    begin = run_end;
  }
}

std::uint64_t Batch::end_of_model(std::uint64_t position) const {
  const std::uint64_t point = point_at(position);
  const protocol::Segment segment = points_->segment_at(point);
  return std::min(position + (segment.first_point + segment.count - point),
                  end_of_run(run_of(position)));
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
