#pragma once

#include <cstdint>
#include <functional>

#include "proto/recipe/point_table.h"
#include "server/store/changes.h"
#include "server/store/known/work.h"
#include "server/study/interval_set.h"

namespace oblique::server {

/// Gives `take` those of the points `open` of `target` that are among the points `known` of
/// `source`: of the same model (by its canonical text) and the same bits of H, mu and e. Both
/// recipes ask for estimated errors or neither does, else there are none. A point of the target
/// comes more than once where the source has it so.
///
/// Two products of axes are compared axis by axis; in other blocks the points of one side are
/// looked up in the other, or in a table of its points when it is no product. What is not found
/// when the work is over stays unfound.
void match_recipes(const protocol::PointTable& target, const IntervalSet& open,
                   const protocol::PointTable& source, const IntervalSet& known, Work& work,
                   const std::function<void(const SharedRun&)>& take);

}  // namespace oblique::server
