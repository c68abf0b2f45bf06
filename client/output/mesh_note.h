#pragma once

#include <ostream>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// Prints one line when a study's contacts are computed on a mesh coarser than that of the preset
/// `converged`, as the published one is, and what is not converged there; nothing otherwise. The
/// recipe is a checked one.
void tell_mesh(std::ostream& out, const protocol::Recipe& recipe);

}  // namespace oblique::client
