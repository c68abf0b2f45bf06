#pragma once

#include <cstddef>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/io/row_output.h"
#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/solve.h"

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

  /// Whether it is the case of these values, which may have gone through decimal text.
  bool is_at(double H, double friction, double e) const;
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

/// A case's numbers of a result.
CaseNumbers own_case(const solver::CaseResult& result);

/// Our numbers for each published case; nothing for one that is not solved.
using OwnCases = std::vector<std::optional<CaseNumbers>>;

enum class Quantity { kFn, kFt, kPhase, kStick };

/// One published number beside ours, in the unit that the paper prints (kN or ms).
struct Difference {
  std::size_t case_index;
  Quantity quantity;
  std::size_t index;  ///< which peak or phase, from 0
  double published;
  std::optional<double> ours;  ///< nothing where we have no such peak, phase or case

  /// (ours - published) / published, in percent.
  std::optional<double> percent() const;
};

/// Every counted published number beside ours; `own` has one entry a case.
std::vector<Difference> compare(const PublishedTable& table, const OwnCases& own);

/// Root mean square and largest size of the differences [%].
struct DifferenceSummary {
  std::size_t counted = 0;
  std::size_t missing = 0;
  double rms_percent = 0.0;
  double largest_percent = 0.0;
  std::optional<Difference> largest;
};
DifferenceSummary summary_of(const std::vector<Difference>& differences);

/// Solves the cases with each finger, all side by side: a list for each. Throws solver::SolveError
/// when one cannot be solved.
std::vector<OwnCases> solved_cases(const PublishedTable& table,
                                   std::span<const solver::Finger> fingers);

/// Reads the cases from rows of `runs` with the columns point, H, mu, e, peaks, phases,
/// stick_total_s and major_mode. A case without a solved point is nothing, and phases from the
/// first ripple on are left out. Throws std::runtime_error when a case has several points.
OwnCases own_cases(const PublishedTable& table, const protocol::Table& rows);

/// Prints the tables for people: forces, durations, stick times, modes and where they are not the
/// published ones, summary, misprints.
void print_comparison(std::ostream& out, const PublishedTable& table, const OwnCases& own);

/// Of these, peaks and modes alone.
void print_modes(std::ostream& out, const PublishedTable& table, const OwnCases& own);

/// The differences as rows, one a published number, for CSV and JSON.
protocol::Table rows_of(const PublishedTable& table, const std::vector<Difference>& differences);

}  // namespace oblique::client
