#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

#include "worker/solver/model/trace.h"

namespace oblique::client {

/// Takes the rows of the fall off the front of a trace: from release (its time is minus the time of
/// the fall) to touch. What is left is the contact, as of a trace without the fall.
inline std::vector<solver::TraceRow> take_fall(std::vector<solver::TraceRow>& rows) {
  const auto touch = std::find_if(rows.begin(), rows.end(), [](const solver::TraceRow& row) {
    return row.state != solver::kFalling;
  });
  std::vector<solver::TraceRow> fall(std::make_move_iterator(rows.begin()),
                                     std::make_move_iterator(touch));
  rows.erase(rows.begin(), touch);
  return fall;
}

}  // namespace oblique::client
