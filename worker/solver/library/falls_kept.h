#pragma once

#include <cstddef>

#include "worker/solver/fall_cache.h"
#include "worker/solver/library/solver.h"

namespace oblique {

class Falls::Cache {
 public:
  explicit Cache(std::size_t most_bytes) : falls({.bytes = most_bytes}) {}

  solver::FallCache falls;
};

}  // namespace oblique
