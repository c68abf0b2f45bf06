#include "client/study/reach.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "worker/solver/model/fall_model.h"
#include "worker/solver/model/number.h"

namespace oblique::client {

namespace {

/// The largest H of a block of which every model has it; nothing (0) where that depends on the
/// point.
double largest_H_m(const protocol::PointTable& table) {
  const protocol::Block& block = table.recipe().blocks(0);
  const protocol::Axis& H = *protocol::point_axes(block)[0];
  const bool is_shared =
      table.models() == 1 || protocol::block_kind(block) == protocol::BlockKind::kProduct;
  if (!is_shared || !H.expression().empty() || !block.where().empty()) {
    return 0.0;
  }
  const double H_m = protocol::largest_value(H);
  return std::isfinite(H_m) ? H_m : 0.0;
}

}  // namespace

ReachChecker::ReachChecker(LargestDrop largest_drop_m)
    : largest_drop_m_(std::move(largest_drop_m)) {}

void ReachChecker::operator()(const protocol::PointTable& block) {
  if (block.models() > kMostFalls) {
    return;
  }
  const double H_m = largest_H_m(block);
  for (std::uint64_t at = 0; at < block.size();) {
    const auto segment = block.segment_at(at);
    at = segment.first_point + segment.count;
    const auto model = block.model(segment.model);
    const double length_m = std::accumulate(model.lengths_m.begin(), model.lengths_m.end(), 0.0);
    if (H_m <= protocol::kSurelyReached * length_m) {
      continue;
    }
    Fall* fall = fall_of(model);
    if (fall == nullptr || is_reached_by_far(*fall, H_m)) {
      continue;
    }
    if (H_m > drop_m(*fall)) {
      throw solver::InputError(
          fmt::format("H = {} m is not allowed: the tip of this finger first turns back after a "
                      "drop of {} m, so H must be at most that",
                      solver::exact_number(H_m), solver::readable_number(drop_m(*fall), 10)));
    }
  }
}

/// The fall of a model, known or new; null for a new one when there are enough.
ReachChecker::Fall* ReachChecker::fall_of(const solver::ModelParameters& model) {
  const solver::ModelParameters falling = solver::fall_model(model);
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
    fall.coarse_drop_m = largest_drop_m_(coarse);
    ++falls_solved_;
  }
  return H_m <= kRoom * *fall.coarse_drop_m;
}

double ReachChecker::drop_m(Fall& fall) {
  if (!fall.drop_m) {
    fall.drop_m = largest_drop_m_(fall.model);
    ++falls_solved_;
  }
  return *fall.drop_m;
}

}  // namespace oblique::client
