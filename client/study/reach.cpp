#include "client/study/reach.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

namespace {

/// Returns the largest H [m] of a block if all its models have the same values of H. Returns 0 if
/// the largest H depends on the point.
double largest_H_m(const protocol::Block& block, std::uint64_t models) {
  const protocol::Axis& H = *protocol::point_axes(block)[0];
  const bool is_shared =
      models == 1 || protocol::block_kind(block) == protocol::BlockKind::kProduct;
  if (!is_shared || !H.expression().empty() || !block.where().empty()) {
    return 0.0;
  }
  const double H_m = protocol::largest_value(H);
  return std::isfinite(H_m) ? H_m : 0.0;
}

}  // namespace

ReachChecker::ReachChecker(LargestDrop largest_drop_m)
    : largest_drop_m_(std::move(largest_drop_m)) {}

void ReachChecker::operator()(const protocol::PointTable& study) {
  const auto& blocks = study.recipe().blocks();
  for (int number = 0; number < blocks.size(); ++number) {
    const auto& place = study.block(static_cast<std::size_t>(number));
    const double H_m = largest_H_m(blocks[number], place.models);
    const std::uint64_t models = place.models <= kMaxFalls ? place.models : 0;
    for (std::uint64_t i = 0; i < models; ++i) {
      const double drop_m = reached_m(study.model(place.first_model + i), H_m);
      if (H_m > drop_m) {
        solver::InputError::Fields fields{
            .text = fmt::format("H = {} m is not allowed: the tip of this finger turns back after "
                                "a drop of {} m, so H must be at most that",
                                solver::exact_number(H_m), solver::readable_number(drop_m, 10)),
            .key = "H"};
        if (blocks.size() > 1) {
          fields.block = static_cast<std::size_t>(number);
        }
        throw solver::InputError(std::move(fields));
      }
    }
  }
}

/// Returns the drop [m] that the tip reaches, at most H. After kMaxFalls solved falls, assumes that
/// the tip reaches H.
double ReachChecker::reached_m(const solver::ModelParameters& model, double H_m) {
  constexpr int kCoarse = 2;      // elements per link; quick to solve, and the fall differs little
  constexpr double kRoom = 0.98;  // safety margin for the drop on the coarse mesh
  const double length_m = std::accumulate(model.lengths_m.begin(), model.lengths_m.end(), 0.0);
  if (H_m <= protocol::kSurelyReached * length_m) {
    return H_m;
  }
  const solver::ModelParameters falling = solver::fall_model(model);
  auto fall = std::find_if(falls_.begin(), falls_.end(),
                           [&](const Fall& known) { return known.model == falling; });
  if (fall == falls_.end()) {
    if (falls_.size() >= kMaxFalls) {
      return H_m;
    }
    fall = falls_.insert(fall, Fall{falling, {}, {}});
  }
  if (falling.elements_per_link > kCoarse) {
    solver::ModelParameters coarse = falling;
    coarse.elements_per_link = kCoarse;
    coarse.dt_fall_s = 0.0;  // the solver chooses steps for the coarse mesh
    if (H_m <= kRoom * solved_drop_m(coarse, fall->coarse_drop_m)) {
      return H_m;
    }
  }
  return std::min(H_m, solved_drop_m(falling, fall->drop_m));
}

double ReachChecker::solved_drop_m(const solver::ModelParameters& model,
                                   std::optional<double>& drop_m) {
  if (!drop_m) {
    drop_m = largest_drop_m_(model);
    ++falls_solved_;
  }
  return *drop_m;
}

}  // namespace oblique::client
