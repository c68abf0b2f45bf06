#include "server/scheduler/points/batch_cut.h"

#include <algorithm>

namespace oblique::server {
namespace {

/// The end of a group near `end`, at most `most`: workers that share a group both solve its falls.
/// A group with too many points is shared.
std::uint64_t border_near(const Interval& cut, std::uint64_t first, std::uint64_t end,
                          std::uint64_t most) {
  if (cut.begin > first && 2 * (cut.begin - first) >= end - first) {
    return cut.begin;
  }
  if (cut.end <= most) {
    return cut.end;
  }
  return cut.begin > first ? cut.begin : end;
}

}  // namespace

std::uint64_t end_of_batch(const protocol::PointTable& table, const PointOrder& order,
                           const Interval& free, const Portion& wanted) {
  const Interval group = order.group_at(table, free.begin);
  const std::uint64_t points = std::max<std::uint64_t>(wanted.points, 1);
  const std::uint64_t room = free.end - free.begin;
  const std::uint64_t most = free.begin + std::min(std::max(points, wanted.most_points), room);
  std::uint64_t end = free.begin + std::min(points, room);
  // `groups` whole ones, as far as there is room.
  std::uint64_t groups_end = group.end;
  for (std::uint64_t groups = 1; groups < wanted.groups && groups_end < most; ++groups) {
    const std::uint64_t next = order.group_at(table, groups_end).end;
    if (next > most) {
      break;
    }
    groups_end = next;
  }
  if (wanted.groups > 1 && groups_end <= most) {
    end = std::max(end, groups_end);
  }
  return end == free.end ? end : border_near(order.group_at(table, end), free.begin, end, most);
}

}  // namespace oblique::server
