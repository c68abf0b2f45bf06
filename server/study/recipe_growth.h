#pragma once

#include <string>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// What a recipe is to the one that a study has.
struct Growth {
  enum class Kind {
    kSame,     ///< the same model and blocks
    kLonger,   ///< it begins with the stored one: the study may grow by the rest
    kShorter,  ///< the stored one begins with it
    kOther,
  };
  Kind kind;
  /// Of a shorter or another recipe: what differs, a line each.
  std::string difference;
};

/// Compares two checked recipes block by block, as they are written. A study grows by blocks behind
/// its own, and by a larger count of its last block's sample unless that is a Latin hypercube.
Growth growth_of(const protocol::Recipe& stored, const protocol::Recipe& given);

}  // namespace oblique::server
