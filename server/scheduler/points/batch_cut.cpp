#include "server/scheduler/points/batch_cut.h"

#include <algorithm>

namespace oblique::server {
namespace {

/// The end of a model near `end`, at `most` or before: two workers that share a model both solve
/// its fall. Where a model has too many points it is shared.
std::uint64_t border_near(const protocol::PointTable& table, std::uint64_t first, std::uint64_t end,
                          std::uint64_t most) {
  const protocol::Segment cut = table.segment_at(end);
  const std::uint64_t cut_end = cut.first_point + cut.count;
  if (cut.first_point > first && 2 * (cut.first_point - first) >= end - first) {
    return cut.first_point;
  }
  if (cut_end <= most) {
    return cut_end;
  }
  return cut.first_point > first ? cut.first_point : end;
}

}  // namespace

std::uint64_t end_of_batch(const protocol::PointTable& table, const Interval& free,
                           const Portion& wanted) {
  const protocol::Segment model = table.segment_at(free.begin);
  const std::uint64_t model_end = model.first_point + model.count;
  const std::uint64_t points = std::max<std::uint64_t>(wanted.points, 1);
  const std::uint64_t room = free.end - free.begin;
  const std::uint64_t most = free.begin + std::min(std::max(points, wanted.most_points), room);
  std::uint64_t end = free.begin + std::min(points, room);
  if (wanted.models > 1 && model_end <= most) {
    // The models that follow have as many points, but where a block ends.
    const std::uint64_t more = std::min(wanted.models - 1, (most - model_end) / model.count);
    end = std::max(end, model_end + more * model.count);
  }
  return end == free.end ? end : border_near(table, free.begin, end, most);
}

std::uint64_t end_of_model(const protocol::PointTable& table, std::uint64_t end) {
  const protocol::Segment last = table.segment_at(end - 1);
  return last.first_point + last.count;
}

}  // namespace oblique::server
