#pragma once

#include <string>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// How a given recipe relates to the stored one of a study.
struct Growth {
  enum class Kind {
    kSame,     ///< the same model and blocks
    kLonger,   ///< the given one begins with the stored one: the study may grow
    kShorter,  ///< the stored one begins with the given one
    kOther,
  };
  Kind kind;
  /// The differences, one per line, if the given recipe is shorter or another one.
  std::string difference;
};

/// Compares two checked recipes block by block, as they are written. A study can grow by more
/// blocks at the end, or by a larger count of its last block's sample unless that is a Latin
/// hypercube.
Growth growth_of(const protocol::Recipe& stored, const protocol::Recipe& given);

}  // namespace oblique::server
