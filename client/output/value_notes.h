#pragma once

#include <ostream>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// Prints a line for each key of the study with a value outside its usual range, which is likely to
/// be in another unit, and for each range of a sample that is a list of values and not drawn from.
/// The recipe is a checked one.
void tell_values(std::ostream& out, const protocol::Recipe& recipe);

}  // namespace oblique::client
