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

/// Where values of a study were written: "study.toml:3:6" or "--mu 0.4".
struct Places {
  std::string whole;  ///< place of the study; empty: none
  /// By block and key; the empty key is the block itself.
  std::vector<std::map<std::string, std::string, std::less<>>> blocks;

  /// Adds the place of the key to an error, or else of its block or the study.
  solver::InputError located(const solver::InputError& error) const;
};

/// A name and the definition of the points.
struct Study {
  std::string name;
  protocol::Recipe recipe;
  Places places = {};
};

/// Checks values that depend on the point (PointTable::validate_points). Throws solver::InputError
/// with the place.
void check_points(const protocol::PointTable& table, const Places& places);
void check_points(const Study& study);

/// Writes a note with the expected errors if the mesh has fewer than eight elements per link.
void note_coarse_mesh(std::ostream& out, const protocol::Recipe& recipe);

/// Writes a note for each key with an unusual value, which is likely to be in another unit, and for
/// each range of a sample whose count makes it a list of values.
void note_unusual_values(std::ostream& out, const protocol::Recipe& recipe);

}  // namespace oblique::client
