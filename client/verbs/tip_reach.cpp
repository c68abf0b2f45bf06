#include "client/verbs/tip_reach.h"

#include <spdlog/fmt/fmt.h>

#include "worker/solver/solve.h"

namespace oblique::client {

ReachCheck tip_reach() {
  return ReachChecker([](const solver::ModelParameters& model) {
    const solver::Finger finger(model);
    WorkLine line;
    return largest_drop_m(finger, line);
  });
}

double largest_drop_m(const solver::Finger& finger, WorkLine& line) {
  const auto falling = line.begin([&finger] {
    return fmt::format("on {} elements a link: {}", finger.model().elements_per_link,
                       fall_so_far(finger.model(), finger.drop_so_far_m()));
  });
  return finger.largest_drop_m();
}

}  // namespace oblique::client
