#pragma once

#include <ostream>

#include "proto/oblique.pb.h"

namespace oblique::client {

// Notes on a valid recipe, for people, a line each.

/// Writes a line where contacts are computed on fewer than eight elements a link, with what that
/// costs in accuracy.
void note_coarse_mesh(std::ostream& out, const protocol::Recipe& recipe);

/// Writes a line for each key with a value outside its usual range, which is likely to be in
/// another unit, and for each range of a sample whose count makes it a list of values.
void note_unusual_values(std::ostream& out, const protocol::Recipe& recipe);

}  // namespace oblique::client
