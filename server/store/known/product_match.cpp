#include "server/store/known/product_match.h"

#include <algorithm>

#include "proto/recipe/axes.h"
#include "proto/recipe/canonical.h"

namespace oblique::server {
namespace {

/// The text of a model in which the keys of axes say nothing.
std::string text_beside(const protocol::Block& keys, solver::ModelParameters model,
                        const solver::ModelParameters& filling) {
  for (const protocol::Axis& axis : keys.axes()) {
    if (const auto* key = solver::find_model_key(axis.key()); key != nullptr) {
      key->set(model, key->get(filling));
    }
  }
  return protocol::canonical_model(model);
}

/// Points between two neighbours on that axis.
std::uint64_t stride_of(const protocol::Block& block, const protocol::Axis& axis) {
  std::uint64_t stride = 1;
  for (auto other = block.axes().rbegin(); &*other != &axis; ++other) {
    stride *= protocol::axis_size(*other);
  }
  return stride;
}

/// Pairs that follow each other on both sides as one run.
void append(std::vector<SharedRun>& runs, const SharedRun& run) {
  if (!runs.empty() && runs.back().point + runs.back().count == run.point &&
      runs.back().source_point + runs.back().count == run.source_point) {
    runs.back().count += run.count;
  } else {
    runs.push_back(run);
  }
}

}  // namespace

std::optional<ProductMatch> ProductMatch::of(const PlacedBlock& target, const PlacedBlock& source,
                                             Work& work) {
  const solver::ModelParameters base = base_model_of(*target.table);
  if (target.block->axes_size() != source.block->axes_size() ||
      text_beside(*target.block, base, base) !=
          text_beside(*target.block, base_model_of(*source.table), base)) {
    return std::nullopt;
  }
  ProductMatch match;
  match.first_ = target.first_point;
  match.source_first_ = source.first_point;
  std::vector<SharedAxis> axes;
  for (const protocol::Axis& axis : target.block->axes()) {
    const protocol::Axis* other = axis_of(*source.block, axis.key());
    if (other == nullptr) {
      return std::nullopt;
    }
    axes.push_back({shared_values(axis, *other, work), protocol::axis_size(axis),
                    protocol::axis_size(*other), stride_of(*target.block, axis),
                    stride_of(*source.block, *other)});
  }
  match.fold(std::move(axes));
  return match;
}

/// Axes of which every value is shared, in the same place, are one with the next slower axis.
void ProductMatch::fold(std::vector<SharedAxis> axes) {
  innermost_ = {{0, 0, 1}};
  std::uint64_t whole = 1;
  while (!axes.empty() && innermost_ == std::vector<SharedRun>{{0, 0, whole}} &&
         axes.back().stride == whole &&
         (axes.back().source_stride == whole || axes.back().source_size == 1)) {
    innermost_.clear();
    for (const auto& [value, source_value] : axes.back().values) {
      append(innermost_, {value * whole, source_value * whole, whole});
    }
    const bool is_same_size = axes.back().size == axes.back().source_size;
    whole *= axes.back().size;
    axes.pop_back();
    if (!is_same_size) {
      break;
    }
  }
  outer_ = std::move(axes);
}

std::uint64_t ProductMatch::runs() const {
  std::uint64_t runs = innermost_.size();
  for (const SharedAxis& axis : outer_) {
    runs *= axis.values.size();
  }
  return runs;
}

void ProductMatch::each(Work& work, const std::function<void(const SharedRun&)>& take) const {
  if (runs() > 0) {
    descend(0, first_, source_first_, work, take);
  }
}

void ProductMatch::descend(std::size_t axis, std::uint64_t point, std::uint64_t source_point,
                           Work& work, const std::function<void(const SharedRun&)>& take) const {
  if (axis == outer_.size()) {
    for (const SharedRun& run : innermost_) {
      if (!work.spend(1)) {
        return;
      }
      take({point + run.point, source_point + run.source_point, run.count});
    }
    return;
  }
  const SharedAxis& shared = outer_[axis];
  for (const auto& [value, source_value] : shared.values) {
    if (work.is_over()) {
      return;
    }
    descend(axis + 1, point + value * shared.stride,
            source_point + source_value * shared.source_stride, work, take);
  }
}

}  // namespace oblique::server
