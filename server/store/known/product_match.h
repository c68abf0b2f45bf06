#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "server/store/known/recipe_blocks.h"
#include "server/store/known/recipe_match.h"

namespace oblique::server {

/// The points that two products of axes share, as runs; they are counted before they are made.
class ProductMatch {
 public:
  /// Compares the axes. Nothing when the products have not the same keys, or lie on models that
  /// differ beside these keys: then points must be looked up one by one.
  static std::optional<ProductMatch> of(const PlacedBlock& target, const PlacedBlock& source,
                                        Work& work);

  /// How many runs there are.
  std::uint64_t runs() const;
  /// Gives them in the order of the target's points.
  void each(Work& work, const std::function<void(const SharedRun&)>& take) const;

 private:
  /// Values that the axes of one key share, and how far apart neighbours of it stand.
  struct SharedAxis {
    std::vector<std::pair<std::uint64_t, std::uint64_t>> values;
    std::uint64_t size;
    std::uint64_t source_size;
    std::uint64_t stride;
    std::uint64_t source_stride;
  };
  void fold(std::vector<SharedAxis> axes);
  void descend(std::size_t axis, std::uint64_t point, std::uint64_t source_point, Work& work,
               const std::function<void(const SharedRun&)>& take) const;

  std::uint64_t first_ = 0;
  std::uint64_t source_first_ = 0;
  std::vector<SharedAxis> outer_;     // the slowest first
  std::vector<SharedRun> innermost_;  // of the axes inside these, from 0
};

}  // namespace oblique::server
