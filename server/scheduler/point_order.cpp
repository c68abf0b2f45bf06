#include "server/scheduler/point_order.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "worker/solver/model/parameters.h"

namespace oblique::server {
namespace {

struct Piece {
  Interval points;
  std::uint64_t fall;  ///< index of the fall in Falls::heads
};

/// The points from `first` on, split into pieces with one fall each, and the first open point of
/// each fall.
struct Falls {
  static constexpr std::uint64_t kNone = ~std::uint64_t{0};

  Falls(const protocol::PointTable& table, std::uint64_t first, const IntervalSet& open) {
    std::unordered_map<std::uint64_t, std::uint64_t> numbers;
    for (std::uint64_t at = first; at < table.size();) {
      const protocol::Segment segment = table.segment_at(at);
      const Interval points{at, segment.first_point + segment.count};
      const std::uint64_t hash = solver::fall_hash(table.model(segment.model));
      const std::uint64_t fall = numbers.try_emplace(hash, numbers.size()).first->second;
      if (pieces.empty() || pieces.back().fall != fall) {
        pieces.push_back({points, fall});
      }
      pieces.back().points.end = points.end;
      heads.resize(numbers.size(), kNone);
      const auto found = open.first_from(points.begin);
      if (heads[fall] == kNone && found && found->begin < points.end) {
        heads[fall] = found->begin;
      }
      at = points.end;
    }
  }
  bool is_open(std::uint64_t fall) const { return heads[fall] != kNone; }

  std::vector<Piece> pieces;
  std::vector<std::uint64_t> heads;  ///< first open point of each fall, or kNone
};

/// Returns whether several points of the block may share a fall. A distribution may give each point
/// its own fall.
bool may_share_falls(const solver::ModelParameters& model, const protocol::Block& block) {
  return std::ranges::none_of(protocol::fall_axes(model, block), &protocol::Axis::has_distribution);
}

}  // namespace

void PointOrder::arrange(const protocol::PointTable& table, std::uint64_t first,
                         const IntervalSet& open, std::uint64_t falls_a_group) {
  const auto& blocks = table.recipe().blocks();
  const auto model = protocol::from_message(table.recipe().model());
  if (first != end_ || table.models() > kMaxModels ||
      std::none_of(blocks.begin(), blocks.end(),
                   [&](const auto& block) { return may_share_falls(model, block); })) {
    return;
  }
  Falls falls(table, first, open);
  if (falls.pieces.size() == falls.heads.size()) {
    return;  // the points of each fall already follow each other
  }
  // Moves falls with open points to the front, and joins the pieces of each fall.
  std::ranges::stable_sort(falls.pieces, {}, [&](const Piece& piece) {
    return std::pair(!falls.is_open(piece.fall), piece.fall);
  });
  end_ = first;
  for (auto begin = falls.pieces.cbegin(); begin != falls.pieces.cend();) {
    groups_.push_back(end_);
    std::uint64_t number = 0;  // number of falls in the group
    auto end = begin;
    for (; end != falls.pieces.cend(); ++end) {
      if (end != begin && end->fall == std::prev(end)->fall) {
        continue;
      }
      const std::uint64_t head = falls.heads[end->fall];
      if (head == Falls::kNone) {
        continue;  // points of a fall without open points belong to the last group
      }
      if (number == falls_a_group) {
        break;
      }
      ++number;
      append({head, head + 1});
    }
    for (; begin != end; ++begin) {
      const std::uint64_t head = falls.heads[begin->fall];
      const bool has_head = head >= begin->points.begin && head < begin->points.end;
      append({begin->points.begin, has_head ? head : begin->points.end});
      append({has_head ? head + 1 : begin->points.end, begin->points.end});
    }
  }
  by_point_.resize(runs_.size());
  std::iota(by_point_.begin(), by_point_.end(), 0U);
  std::sort(by_point_.begin(), by_point_.end(),
            [this](std::uint32_t a, std::uint32_t b) { return runs_[a].point < runs_[b].point; });
}

void PointOrder::append(const Interval& points) {
  if (points.begin == points.end) {
    return;
  }
  if (runs_.empty() || runs_.back().point + (end_ - runs_.back().place) != points.begin) {
    runs_.push_back({end_, points.begin});
  }
  end_ += points.end - points.begin;
}

std::uint64_t PointOrder::end_of_run(std::size_t run) const {
  return run + 1 < runs_.size() ? runs_[run + 1].place : end_;
}

std::size_t PointOrder::run_of_place(std::uint64_t place) const {
  const auto after =
      std::upper_bound(runs_.begin(), runs_.end(), place,
                       [](std::uint64_t at, const Run& run) { return at < run.place; });
  return static_cast<std::size_t>(std::distance(runs_.begin(), after)) - 1;
}

std::uint64_t PointOrder::place(std::uint64_t point) const {
  if (point >= end_) {
    return point;
  }
  const auto after = std::upper_bound(
      by_point_.begin(), by_point_.end(), point,
      [this](std::uint64_t at, std::uint32_t run) { return at < runs_[run].point; });
  const Run& run = runs_[*std::prev(after)];
  return run.place + (point - run.point);
}

std::uint64_t PointOrder::point(std::uint64_t place) const {
  if (place >= end_) {
    return place;
  }
  const Run& run = runs_[run_of_place(place)];
  return run.point + (place - run.place);
}

std::vector<Interval> PointOrder::points(const Interval& places) const {
  std::vector<Interval> points;
  std::uint64_t at = places.begin;
  for (std::size_t run = at < end_ ? run_of_place(at) : runs_.size(); at < places.end; ++run) {
    const std::uint64_t end = at < end_ ? std::min(end_of_run(run), places.end) : places.end;
    const std::uint64_t first = point(at);
    if (points.empty() || points.back().end != first) {
      points.push_back({first, first});
    }
    points.back().end += end - at;
    at = end;
  }
  return points;
}

IntervalSet PointOrder::places(const IntervalSet& points) const {
  if (!is_arranged()) {
    return points;
  }
  std::vector<Interval> parts;
  points.for_each([&](const Interval& interval) {
    for (std::uint64_t at = interval.begin; at < interval.end;) {
      const std::uint64_t first = place(at);
      const std::uint64_t room =
          at < end_ ? end_of_run(run_of_place(first)) - first : interval.end - at;
      const std::uint64_t count = std::min(room, interval.end - at);
      parts.push_back({first, first + count});
      at += count;
    }
  });
  std::ranges::sort(parts, {}, &Interval::begin);  // inserting sorted parts is fast
  IntervalSet places;
  places.insert(parts);
  return places;
}

Interval PointOrder::group_at(const protocol::PointTable& table, std::uint64_t place) const {
  if (place < end_) {
    const auto after = std::upper_bound(groups_.begin(), groups_.end(), place);
    return {*std::prev(after), after == groups_.end() ? end_ : *after};
  }
  const protocol::Segment segment = table.segment_at(place);
  return {std::max(segment.first_point, end_), segment.first_point + segment.count};
}

}  // namespace oblique::server
