#pragma once

#include <string>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// What a recipe is to the one of a study that is there.
struct Growth {
  enum class Kind {
    kSame,     ///< the same points of the same models, however it was written
    kLonger,   ///< it begins with all of the stored one: the study may grow by the rest
    kShorter,  ///< the stored one begins with all of it, and goes on
    kOther,
  };
  Kind kind;
  /// Of a shorter or another recipe: what differs, a line each, with what is stored and what is
  /// given; no more than some ten.
  std::string difference;
};

/// Compares two recipes that were judged, by their canonical texts. A study grows by further blocks
/// behind its own, and by a larger count of its last block's sample if that is random or of Sobol.
/// Costs in proportion to the recipes; blocks that are the same bytes cost little.
Growth growth_of(const protocol::Recipe& stored, const protocol::Recipe& given);

}  // namespace oblique::server
