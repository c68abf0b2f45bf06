#pragma once

#include <string>

#include "server/asking/sql/sql_items.h"

namespace oblique::server {

/// The unit of what an item of columns gives, where it follows from those of its columns: avg(x),
/// max(x) - min(x), abs(x) and elements of lists have the unit of x. Empty: a pure number, a text,
/// or not known.
std::string unit_of(const SqlItem& item);

}  // namespace oblique::server
