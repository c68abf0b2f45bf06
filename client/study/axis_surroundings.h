#pragma once

#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/written/written_axis.h"
#include "proto/recipe/written/written_sample.h"

namespace oblique::client {

/// How a block puts its axes together, as far as it decides what may stand for an axis.
struct AxisSurroundings {
  bool is_zip = false;     ///< side by side: a value may come twice
  bool is_sample = false;  ///< two ends alone are a uniform distribution

  /// An axis of listed values.
  protocol::Axis listed(const solver::ParameterKey& key, const std::vector<double>& values) const {
    return is_zip ? protocol::column_axis(key, values) : protocol::listed_axis(key, values);
  }
};

}  // namespace oblique::client
