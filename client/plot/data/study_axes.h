#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::client::plot {

/// A key of a study that the recipe gives values to.
struct StudyAxis {
  std::string key;     ///< as studies write it: "E"
  std::string column;  ///< as questions do: "E_Pa"; for single lengths an expression
  /// Values of the block with the most points, rising; none where they are drawn from a
  /// distribution or follow from others, or are more than kMostListed.
  std::vector<double> values = {};
  std::vector<double> all_values = {};  ///< the same of all blocks
  bool is_listed = true;                ///< `values` has them all
  bool is_logarithmic = false;          ///< its range is

  /// Whether it has more than one value in the block with the most points.
  bool varies() const { return !is_listed || values.size() > 1; }
};
inline constexpr std::uint64_t kMostListed = 100'000;

/// What a study is made of, as far as pictures need it.
struct StudyShape {
  std::vector<StudyAxis> axes;  ///< in the order of the recipe: model keys, then H, mu and e
  bool is_grid = true;          ///< the block with the most points is a product of its axes
  std::uint64_t points = 0;     ///< in that block

  /// nullptr: there is none of that key or column.
  const StudyAxis* find(std::string_view name) const;
  /// The keys with more than one value.
  std::vector<const StudyAxis*> varying() const;
};

/// Of a recipe that was judged. Throws solver::InputError for one that is none.
StudyShape shape_of(const protocol::Recipe& recipe);

}  // namespace oblique::client::plot
