#include "client/study/reach.h"

#include <algorithm>
#include <numeric>

#include "client/study/axis.h"
#include "worker/solver/model/number.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

using solver::InputError;

double largest_H_m(const protocol::Block& block) {
  const auto& axis = *std::find_if(block.axes().begin(), block.axes().end(),
                                   [](const protocol::Axis& a) { return a.key() == "H"; });
  return axis.count() > 0 ? axis.to()
                          : *std::max_element(axis.values().begin(), axis.values().end());
}

/// First point of a block and the first after it.
struct PointRange {
  std::uint64_t begin;
  std::uint64_t end;
};
PointRange points_of_block(const protocol::PointTable& table, int block) {
  PointRange range{0, 0};
  for (int b = 0; b <= block; ++b) {
    std::uint64_t points = 1;
    for (const auto& axis : table.recipe().blocks(b).axes()) {
      points *= protocol::axis_size(axis);
    }
    range = {range.end, range.end + points};
  }
  return range;
}

}  // namespace

void ReachChecker::operator()(const protocol::PointTable& table, int block) {
  // No finger falls through less than this part of its length, so lower drops need no look.
  constexpr double kSurelyReached = 0.9;
  if (table.models() > kMostFalls) {
    return;
  }
  const double H_m = largest_H_m(table.recipe().blocks(block));
  const PointRange points = points_of_block(table, block);
  for (std::uint64_t at = points.begin; at < points.end;) {
    const auto segment = table.segment_at(at);
    at = segment.first_point + segment.count;
    const auto model = table.model(segment.model);
    const double length_m = std::accumulate(model.lengths_m.begin(), model.lengths_m.end(), 0.0);
    if (H_m <= kSurelyReached * length_m) {
      continue;
    }
    Fall* fall = fall_of(model);
    if (fall == nullptr || is_reached_by_far(*fall, H_m)) {
      continue;
    }
    if (H_m > largest_drop_m(*fall)) {
      throw InputError(
          "H = " + solver::exact_number(H_m) +
          " m is not allowed: the tip of this finger first turns back after a drop of " +
          solver::readable_number(largest_drop_m(*fall), 10) + " m, so H must be at most that");
    }
  }
}

/// The fall of a model, known or new; null for a new one when there are enough.
ReachChecker::Fall* ReachChecker::fall_of(const solver::ModelParameters& model) {
  // A fall does not depend on these keys; models that differ there alone share one.
  solver::ModelParameters falling = model;
  const solver::ModelParameters defaults;
  falling.k_N_m = defaults.k_N_m;
  falling.eta2 = defaults.eta2;
  falling.dt_s = defaults.dt_s;
  const auto known = std::find_if(falls_.begin(), falls_.end(),
                                  [&](const Fall& fall) { return fall.model == falling; });
  if (known != falls_.end()) {
    return &*known;
  }
  return falls_.size() < kMostFalls ? &falls_.emplace_back(Fall{falling, {}, {}}) : nullptr;
}

/// Whether a coarse mesh, which falls nearly alike and at a small part of the cost, passes H with
/// room to spare.
bool ReachChecker::is_reached_by_far(Fall& fall, double H_m) {
  constexpr int kCoarse = 2;
  constexpr double kRoom = 0.98;
  if (fall.model.elements_per_link <= kCoarse) {
    return false;
  }
  if (!fall.coarse_drop_m) {
    solver::ModelParameters coarse = fall.model;
    coarse.elements_per_link = kCoarse;
    coarse.dt_fall_s = 0.0;  // the coarse mesh's own
    fall.coarse_drop_m = solver::Finger(coarse).largest_drop_m();
    ++falls_solved_;
  }
  return H_m <= kRoom * *fall.coarse_drop_m;
}

double ReachChecker::largest_drop_m(Fall& fall) {
  if (!fall.drop_m) {
    fall.drop_m = solver::Finger(fall.model).largest_drop_m();
    ++falls_solved_;
  }
  return *fall.drop_m;
}

}  // namespace oblique::client
