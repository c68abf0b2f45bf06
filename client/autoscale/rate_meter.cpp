#include "client/autoscale/rate_meter.h"

#include <algorithm>

namespace oblique::client {

void RateMeter::update(const Demand& demand, double now_s) {
  const auto threads = static_cast<double>(demand.threads);
  if (demand.threads == 0 || demand.open_points < demand.threads) {
    mark_.reset();
    return;
  }
  if (settings_.settle_s == 0.0 && demand.points_per_s > 0.0) {
    rate_ = demand.points_per_s / threads;
    return;
  }
  if (!mark_ || mark_->threads != demand.threads || demand.settled_points < mark_->settled_points) {
    mark_ = {now_s, demand.settled_points, demand.threads};
    return;
  }
  const double elapsed_s = now_s - mark_->at_s;
  if (elapsed_s < settings_.settle_s || elapsed_s <= 0.0) {
    return;
  }
  const auto settled = demand.settled_points - mark_->settled_points;
  if (settled > 0) {
    rate_ = static_cast<double>(settled) / (elapsed_s * threads);
  } else {
    const double most = 1.0 / (elapsed_s * threads);
    rate_ = std::min(rate_.value_or(most), most);
  }
  if (elapsed_s > settings_.window_s) {
    mark_ = {now_s, demand.settled_points, demand.threads};
  }
}

}  // namespace oblique::client
