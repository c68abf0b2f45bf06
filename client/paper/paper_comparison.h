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

/// Numbers of one impact in the paper's units, with ripples merged.
struct CaseNumbers {
  std::string mode;
  std::vector<double> fn_kN;      ///< F_n at each major peak
  std::vector<double> ft_kN;      ///< largest |F_t| near each major peak
  std::vector<double> phases_ms;  ///< duration of each phase
  std::optional<double> stick_ms;
};

struct PublishedCase : CaseNumbers {
  double H_m;
  double mu;
  double e_star;
  std::string read;  ///< place in the paper, such as a table

  /// Whether this case has the given values, up to rounding in decimal text.
  bool is_at(double H, double friction, double e) const;
};

/// A number that is printed wrongly in the paper.
struct Misprint {
  std::string where;
  std::vector<std::string> printed;
  std::string why;
};

struct PublishedTable {
  std::vector<PublishedCase> cases;
  std::vector<Misprint> misprints;
};

/// Returns the table client/paper/published.toml, which is compiled into the program.
PublishedTable published_table();

/// Returns the number of peaks of F_n in the case's mode: one per compression phase.
int published_peaks(const PublishedCase& published);

/// Extracts from a result the numbers that the paper publishes.
CaseNumbers own_case(const solver::CaseResult& result);

/// Our numbers for each published case; nothing for a case without a result.
using OwnCases = std::vector<std::optional<CaseNumbers>>;

enum class Quantity { kFn, kFt, kPhase, kStick };

/// A published number and our number, in the paper's unit (kN or ms).
struct Difference {
  std::size_t case_index;
  Quantity quantity;
  std::size_t index;  ///< number of the peak or phase, counted from 0
  double published;
  std::optional<double> ours;  ///< nothing if we have no such peak, phase or case

  /// (ours - published) / published, in percent.
  std::optional<double> percent() const;
};

/// Returns all published numbers except misprints, each with our number; `own` has one entry per
/// case.
std::vector<Difference> compare(const PublishedTable& table, const OwnCases& own);

/// Root mean square and maximum size of the differences [%].
struct DifferenceSummary {
  std::size_t counted = 0;
  std::size_t missing = 0;
  double rms_percent = 0.0;
  double largest_percent = 0.0;
  std::optional<Difference> largest;
};
DifferenceSummary summary_of(const std::vector<Difference>& differences);

/// Solves the cases with each finger, in parallel; returns one list per finger. Throws
/// solver::SolveError if a case cannot be solved.
std::vector<OwnCases> solved_cases(const PublishedTable& table,
                                   std::span<const solver::Finger> fingers);

/// Reads the cases from rows of `runs` with the columns point, H, mu, e, peaks, phases,
/// stick_total_s and major_mode. A case without a solved point is empty. Omits phases from the
/// first ripple on. Throws std::runtime_error if a case has several points.
OwnCases own_cases(const PublishedTable& table, const protocol::Table& rows);

/// Prints the tables: forces, durations, stick times, modes, differing modes, summary, misprints.
void print_comparison(std::ostream& out, const PublishedTable& table, const OwnCases& own);

/// Prints only peaks and modes.
void print_modes(std::ostream& out, const PublishedTable& table, const OwnCases& own);

/// Returns the differences as rows for CSV and JSON, one per published number.
protocol::Table rows_of(const PublishedTable& table, const std::vector<Difference>& differences);

}  // namespace oblique::client
