#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// What the paper publishes of one impact.
struct PublishedCase {
  double H_m;
  double mu;
  double e_star;
  std::string mode;  ///< with ripples merged
  std::string read;  ///< where the numbers stand
  std::vector<double> fn_kN;
  std::vector<double> ft_kN;
  std::vector<double> phases_ms;
  std::optional<double> stick_ms;
};

/// Something printed that cannot be read as it stands.
struct Misprint {
  std::string where;
  std::vector<std::string> printed;
  std::string why;
};

struct PublishedTable {
  std::vector<PublishedCase> cases;
  std::vector<Misprint> misprints;
};

/// The table that this program was built with: client/paper/published.toml.
PublishedTable published_table();

/// Reads the text of such a file. Throws std::runtime_error when something is missing.
PublishedTable parse_published_table(std::string_view toml);

/// Peaks of F_n that the case's mode has: one each time that compression ends.
int published_peaks(const PublishedCase& published);

/// A recipe of the cases in their order, all of one preset. Throws solver::InputError for an
/// unknown preset.
protocol::Recipe recipe_of(const PublishedTable& table, std::string_view preset);

}  // namespace oblique::client
