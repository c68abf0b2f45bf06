#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/store/store.h"
#include "tests/support/points.h"

namespace oblique::test {

/// Adds a study with the number 1 and `points` points; the first `solved` points have a result.
inline void add_study(server::Store& store, const std::string& name, std::uint64_t points,
                      std::uint64_t solved) {
  const auto table = server::table_of(points);
  server::AddResults results{1, table, 0, "", "", 1, "2024-01-01T00:00:00.000Z", {}};
  for (std::uint64_t point = 0; point < solved; ++point) {
    results.results.push_back(server::solved_point(point));
  }
  const std::vector<server::Change> changes{
      server::AddStudy{1, name, table, "2024-01-01T00:00:00.000Z"}, results};
  store.commit(changes);
}

}  // namespace oblique::test
