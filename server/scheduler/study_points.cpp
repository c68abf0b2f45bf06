#include "server/scheduler/study_points.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

namespace oblique::server {

StudyPoints::StudyPoints(StudyTable table, IntervalSet settled, const LossLimits& limits)
    : table_(std::move(table)),
      limits_(limits),
      fresh_(0, table_.size()),
      settled_(std::move(settled)) {
  settled_.erase(table_.size(), std::numeric_limits<std::uint64_t>::max());
  settled_.for_each([this](const Interval& run) { fresh_.erase(run.begin, run.end); });
}

std::optional<Chunk> StudyPoints::take(std::uint64_t at_most) {
  if (has(Standing::kSound)) {
    return take(Standing::kSound, at_most);
  }
  if (fresh_.empty()) {
    return std::nullopt;
  }
  const Interval run = fresh_.front();
  const protocol::Segment segment = table_->segment_at(run.begin);
  const std::uint64_t end =
      std::min({run.end, segment.first_point + segment.count, run.begin + at_most});
  fresh_.erase(run.begin, end);
  leased_.insert(run.begin, end);
  return Chunk{segment.model, run.begin, end - run.begin, 0, {}};
}

std::optional<Chunk> StudyPoints::take(Standing standing, std::uint64_t at_most) {
  Returned& chunks = returned(standing);
  if (chunks.empty()) {
    return std::nullopt;
  }
  const auto [first, history] = *chunks.begin();
  const std::uint64_t end = std::min(history.end, first + at_most);
  chunks.erase(chunks.begin());
  if (end < history.end) {
    chunks.emplace(end, history);
  }
  leased_.insert(first, end);
  return Chunk{table_->segment_at(first).model, first, end - first, history.attempts,
               history.losses};
}

std::optional<Chunk> StudyPoints::take_condemned(std::uint64_t point, std::int64_t until_ms) {
  Returned& condemned = returned(Standing::kCondemned);
  const auto found = condemned.find(point);
  if (found == condemned.end() || found->second.returned_ms > until_ms) {
    return std::nullopt;
  }
  const History history = found->second;
  condemned.erase(found);
  leased_.insert(point);
  return Chunk{table_->segment_at(point).model, point, 1, history.attempts, history.losses};
}

void StudyPoints::give_back(const Interval& range, std::uint32_t attempts,
                            const LossHistory& losses, std::int64_t now_ms) {
  Returned& chunks = returned(losses.standing(limits_));
  for (const Interval& run : leased_.within(range.begin, range.end)) {
    chunks.emplace(run.begin, History{run.end, attempts, losses, now_ms});
  }
  leased_.erase(range.begin, range.end);
}

void StudyPoints::take_back_losses(ProcessNumber process) {
  Returned cleared;
  for (Returned& chunks : returned_) {
    for (auto chunk = chunks.begin(); chunk != chunks.end();) {
      const auto next = std::next(chunk);
      if (chunk->second.losses.take_back(process)) {
        cleared.insert(chunks.extract(chunk));
      }
      chunk = next;
    }
  }
  for (auto& [first, history] : cleared) {
    returned(history.losses.standing(limits_)).emplace(first, history);
  }
}

bool StudyPoints::receive(std::uint64_t point) {
  if (leased_.contains(point)) {
    leased_.erase(point);
  } else if (fresh_.contains(point)) {
    fresh_.erase(point);
  } else if (std::none_of(returned_.begin(), returned_.end(),
                          [&](Returned& chunks) { return erase_from(chunks, point); })) {
    return false;
  }
  committing_.insert(point);
  return true;
}

bool StudyPoints::erase_from(Returned& chunks, std::uint64_t point) {
  auto chunk = chunks.upper_bound(point);
  if (chunk == chunks.begin() || (--chunk)->second.end <= point) {
    return false;
  }
  const History history = chunk->second;
  if (chunk->first == point) {
    chunks.erase(chunk);
  } else {
    chunk->second.end = point;
  }
  if (point + 1 < history.end) {
    chunks.emplace(point + 1, history);
  }
  return true;
}

bool StudyPoints::settle(std::uint64_t point) {
  if (!committing_.contains(point)) {
    return false;
  }
  committing_.erase(point);
  settled_.insert(point);
  return true;
}

std::uint64_t StudyPoints::reopen(const IntervalSet& points) {
  std::uint64_t reopened = 0;
  points.for_each([&](const Interval& asked) {
    for (const Interval& run : settled_.within(asked.begin, asked.end)) {
      settled_.erase(run.begin, run.end);
      fresh_.insert(run.begin, run.end);
      reopened += run.end - run.begin;
    }
  });
  return reopened;
}

void StudyPoints::count_attempts(const AttemptRuns& attempts) {
  // Workers may say any number; what is added to it must not overflow.
  constexpr std::uint32_t kMostAttempts = 1'000'000'000;
  attempts.for_each([this](const Interval& counted, std::uint32_t times) {
    for (const Interval& run : fresh_.within(counted.begin, counted.end)) {
      fresh_.erase(run.begin, run.end);
      for (std::uint64_t first = run.begin; first < run.end;) {
        const protocol::Segment segment = table_->segment_at(first);
        const std::uint64_t end = std::min(run.end, segment.first_point + segment.count);
        returned(Standing::kSound)
            .emplace(first, History{end, times < kMostAttempts ? times : kMostAttempts, {}, 0});
        first = end;
      }
    }
  });
}

std::vector<std::uint64_t> StudyPoints::condemned() const {
  std::vector<std::uint64_t> points;
  for (const auto& [first, history] : returned(Standing::kCondemned)) {
    points.push_back(first);
  }
  return points;
}

std::uint64_t StudyPoints::free() const {
  return table_.size() - leased_.size() - committing_.size() - settled_.size();
}

void StudyPoints::check_invariants() const {
  IntervalSet all;
  std::uint64_t points = 0;
  const auto add = [&](const Interval& run) {
    if (run.begin >= run.end) {
      throw std::logic_error("a study holds an empty run of points");
    }
    all.insert(run.begin, run.end);
    points += run.end - run.begin;
  };
  for (const auto* set : {&fresh_, &leased_, &committing_, &settled_}) {
    set->for_each(add);
  }
  for (const Standing standing :
       {Standing::kSound, Standing::kSuspect, Standing::kAccused, Standing::kCondemned}) {
    for (const auto& [first, history] : returned(standing)) {
      add({first, history.end});
      if (history.losses.standing(limits_) != standing) {
        throw std::logic_error("returned points are in the place of another standing");
      }
    }
  }
  if (points != table_.size() || !(all == IntervalSet(0, table_.size()))) {
    throw std::logic_error("a point of a study is in no place or in two");
  }
}

}  // namespace oblique::server
