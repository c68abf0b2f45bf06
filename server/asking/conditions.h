#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "server/asking/value_set.h"

namespace oblique::server {

/// Values that columns must have at the same time, each between brackets of its own.
using Box = std::map<std::string, ValueSet>;

/// What of a condition can be known from inputs alone: every point that meets the condition lies in
/// one of the boxes. One box without columns: nothing is known.
using Boxes = std::vector<Box>;

/// The boxes of `condition`, which passed check_sql_part, over the columns that are inputs or the
/// number of the point. Understands comparisons with numbers, BETWEEN, IN, AND, OR and brackets;
/// what it does not understand restricts nothing.
Boxes boxes_of(std::string_view condition);

}  // namespace oblique::server
