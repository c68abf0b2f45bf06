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

/// Places in which a user wrote the values of a study: "study.toml:3:6" or "--mu 0.4".
struct Places {
  std::string whole;  ///< place of the study; empty if it has none
  /// Places by block and key. The empty key gives the place of the block itself.
  std::vector<std::map<std::string, std::string, std::less<>>> blocks;

  /// Adds to an error the place of its key, or else of its block or of the study.
  solver::InputError located(const solver::InputError& error) const;
};

/// The name of a study and the definition of its points.
struct Study {
  std::string name;
  protocol::Recipe recipe;
  Places places = {};
};

/// Checks values that depend on the point (PointTable::validate_points). Throws solver::InputError
/// that names the place.
void check_points(const protocol::PointTable& table, const Places& places);
void check_points(const Study& study);

/// Writes a note with the expected errors if the mesh has fewer than eight elements per link.
void note_coarse_mesh(std::ostream& out, const protocol::Recipe& recipe);

/// Writes a note for each key with an unusual value, which is likely to be in another unit. Also
/// writes a note for each range with a count in a sample, because it is a list of values.
void note_unusual_values(std::ostream& out, const protocol::Recipe& recipe);

}  // namespace oblique::client
