#pragma once

#include <cstdint>
#include <ostream>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// Numbers, from 0, of the blocks whose values only their points tell and that have too many points
/// to look at (`PointTable::survey`): a point of theirs that is not allowed fails. The recipe is a
/// checked one.
std::vector<std::uint64_t> unjudged_blocks(const protocol::Recipe& recipe);

/// Prints one line when a study has such blocks; nothing otherwise.
void tell_unjudged(std::ostream& out, const protocol::Recipe& recipe);

}  // namespace oblique::client
