#pragma once

#include <functional>
#include <map>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {

/// Where the values of a study were written: "study.toml:3:6" or "--mu 0.4".
struct Places {
  std::string whole;  ///< of the study; empty: none
  /// By key; that of the empty key is the block's.
  std::vector<std::map<std::string, std::string, std::less<>>> blocks;

  /// The error with the place of its key, or else of its block or the study.
  solver::InputError located(const solver::InputError& error) const;
};

/// A study as people write it: a name and the definition of its points.
struct Study {
  std::string name;
  protocol::Recipe recipe;
  Places places = {};
};

/// Checks the values that only single points show (PointTable::validate_points). Throws
/// solver::InputError with the place.
void check_points(const protocol::PointTable& table, const Places& places);
void check_points(const Study& study);

/// Writes a note where contacts are computed on fewer than eight elements a link, with what that
/// costs in accuracy.
void note_coarse_mesh(std::ostream& out, const protocol::Recipe& recipe);

/// Writes a note for each key with a value outside its usual range, which is likely to be in
/// another unit, and for each range of a sample whose count makes it a list of values.
void note_unusual_values(std::ostream& out, const protocol::Recipe& recipe);

}  // namespace oblique::client
