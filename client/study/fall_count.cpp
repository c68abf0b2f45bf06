#include "client/study/fall_count.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/canonical.h"
#include "proto/recipe/keys.h"
#include "worker/solver/model/fall_model.h"

namespace oblique::client {
namespace {

/// So many models are looked at one by one.
constexpr std::uint64_t kMostModels = 20'000;
/// Models of a block that tell of all.
constexpr std::uint64_t kLookedAt = 2'000;

/// The fall of a model, as a text that says all it depends on.
std::string fall_of(const protocol::PointTable& table, std::uint64_t model) {
  return protocol::canonical_model(solver::fall_model(table.model(model)));
}

std::uint64_t counted_falls(const protocol::PointTable& table) {
  std::unordered_set<std::string> falls;
  for (std::uint64_t model = 0; model < table.models(); ++model) {
    falls.insert(fall_of(table, model));
  }
  return falls.size();
}

/// Whether models that differ in the values of this axis alone fall in different ways.
bool changes_fall(const protocol::Axis& axis, solver::ModelParameters model, bool has_integrators) {
  if (has_integrators) {
    model.integrator = solver::Integrator::kGeneralizedAlpha;  // its fall depends on more
  }
  const auto& key = protocol::axis_key(axis.key());
  const bool is_fixed = axis.expression().empty() && !protocol::is_drawn(axis);
  if (is_fixed && protocol::axis_size(axis) == 1) {
    return false;
  }
  double least = key.get(model) / 2.0;
  double largest = key.get(model);
  if (axis.expression().empty()) {
    least = protocol::smallest_value(axis);
    largest = protocol::largest_value(axis);
  }
  if (!std::isfinite(least) || !std::isfinite(largest) || least == largest) {
    least = 1e-9;  // what an expression or an open end gives is not known: any two values
    largest = 1.0;
  }
  auto one = model;
  auto other = model;
  key.set(one, least);
  key.set(other, largest);
  return !(solver::fall_model(one) == solver::fall_model(other));
}

/// Falls of a block by a part of its models, as species are counted by those that were met once and
/// twice (Chao 1984). All of them are met once where each model has its own.
std::uint64_t estimated_falls(const protocol::PointTable& table,
                              const protocol::BlockPlace& place) {
  constexpr double kGoldenRatio = 0.6180339887498949;  // steps that meet no period of the axes
  std::unordered_map<std::string, int> met;
  const std::uint64_t count = std::min(place.models, kLookedAt);
  for (std::uint64_t i = 0; i < count; ++i) {
    const double part = std::fmod(static_cast<double>(i) * kGoldenRatio, 1.0);
    const auto model = static_cast<std::uint64_t>(part * static_cast<double>(place.models));
    ++met[fall_of(table, place.first_model + std::min(model, place.models - 1))];
  }
  const auto met_times = [&](int times) {
    return static_cast<double>(std::count_if(
        met.begin(), met.end(), [&](const auto& fall) { return fall.second == times; }));
  };
  if (met.size() == count) {
    return place.models;
  }
  const double unseen = met_times(1) * (met_times(1) - 1.0) / (2.0 * (met_times(2) + 1.0));
  return std::min(place.models, met.size() + static_cast<std::uint64_t>(unseen));
}

}  // namespace

FallCount count_falls(const protocol::PointTable& table) {
  if (table.models() <= kMostModels) {
    return {counted_falls(table), false};
  }
  const solver::ModelParameters base = table.model(0);
  std::unordered_set<std::string> single;  // of blocks of one fall, which may be shared
  FallCount count{0, false};
  for (int i = 0; i < table.recipe().blocks_size(); ++i) {
    const protocol::Block& block = table.recipe().blocks(i);
    const auto& place = table.block(static_cast<std::size_t>(i));
    const auto axes = protocol::model_axes(block);
    const bool has_integrators = std::any_of(
        axes.begin(), axes.end(), [](const auto* axis) { return axis->key() == "integrator"; });
    std::vector<const protocol::Axis*> changing;
    std::copy_if(axes.begin(), axes.end(), std::back_inserter(changing),
                 [&](const auto* axis) { return changes_fall(*axis, base, has_integrators); });
    if (changing.empty()) {
      single.insert(fall_of(table, place.first_model));
    } else if (protocol::is_plain_product(block)) {
      count.falls += protocol::combinations(changing);
    } else {
      count.falls += estimated_falls(table, place);
      count.is_estimate = true;
    }
  }
  count.falls += single.size();
  return count;
}

}  // namespace oblique::client
