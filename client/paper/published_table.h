#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::client {

/// Numbers of one impact in the units that the paper prints, ripples merged.
struct CaseNumbers {
  std::string mode;
  std::vector<double> fn_kN;      ///< F_n at each major peak
  std::vector<double> ft_kN;      ///< largest |F_t| around each major peak
  std::vector<double> phases_ms;  ///< how long each lasts
  std::optional<double> stick_ms;
};

/// What the paper publishes of one impact.
struct PublishedCase : CaseNumbers {
  double H_m;
  double mu;
  double e_star;
  std::string read;  ///< where the numbers are printed
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

/// Peaks of F_n that the case's mode has: one each time that compression ends.
int published_peaks(const PublishedCase& published);

}  // namespace oblique::client
