#pragma once

#include <ostream>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// Prints one line when contacts of a study are computed on fewer than eight elements a link, with
/// what that costs in accuracy; nothing otherwise. The recipe is a checked one.
void tell_mesh(std::ostream& out, const protocol::Recipe& recipe);

}  // namespace oblique::client
