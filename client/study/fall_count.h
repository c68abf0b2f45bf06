#pragma once

#include <cstdint>

#include "proto/recipe/point_table.h"

namespace oblique::client {

/// How many different falls the models of a study have.
struct FallCount {
  std::uint64_t falls;
  bool is_estimate;  ///< made from some of the models
};

/// Few models are looked at one by one. Of many, products of lists and ranges are counted by the
/// axes that change a fall (fall_model.h), and of other blocks some models tell: the number is an
/// estimate then. Models of points that a filter leaves out count too.
FallCount count_falls(const protocol::PointTable& table);

}  // namespace oblique::client
