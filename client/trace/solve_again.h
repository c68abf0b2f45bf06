#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "client/io/console.h"
#include "client/io/progress.h"
#include "client/io/row_output.h"
#include "client/service/connection.h"
#include "client/study/reach.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/trace_columns.h"
#include "worker/solver/solve.h"

namespace oblique::client {

/// Solves falls in this process to check whether the tip reaches an H. The console must outlive it.
ReachCheck tip_reach(Console& console);

/// Largest drop of the tip. Solves the fall if necessary and shows it on `line`.
double largest_drop_m(const solver::Finger& finger, StatusLine& line);

/// A point to be solved in this process.
struct PointToSolve {
  double H_m = 0.0;
  double mu = 0.0;
  double e_star = 0.0;
  bool errors = false;  ///< also estimate errors
};

/// Solves the point in this process and passes its instants to `tracing`. `shows_status`: the
/// terminal is free for a status line. Errors that cannot be estimated are left out, with a note.
/// Throws as Finger::solve does.
solver::CaseResult solve_here(Console& console, const solver::Finger& finger,
                              const PointToSolve& point, const solver::Tracing& tracing,
                              bool shows_status = true);

/// A point of a study with everything needed to solve it.
struct PointSpec : PointToSolve {
  std::string study;
  std::uint64_t point = 0;
  solver::ModelParameters model;
};

/// Selects a point of a study and who solves it again.
struct PointSource {
  SourceFlags source;
  bool is_local = false;      ///< --local
  bool is_on_worker = false;  ///< --on-worker
};
/// Adds --local, --on-worker and the flags of add_source_flags.
void add_point_source(CLI::App& command, PointSource& flags);

struct TraceOptions {
  bool with_shape = false;
  bool with_fall = false;
  std::uint64_t every = 1;         ///< write each K-th instant and all ends of phases; 0: as many
                                   ///< as fit
  std::int64_t time_limit_ms = 0;  ///< 0: the server's default
};

struct SolvedAgain {
  PointSpec point;
  std::optional<solver::CaseResult> result = {};  ///< none if a worker sent unknown outputs
  std::string solver;                             ///< "here" or "by worker ann (avx2)"
  std::uint64_t every = 1;      ///< one in `every` instants of the contact has a row
  std::string comparison = {};  ///< with the stored row: "same as stored"
  bool is_confirmed = true;     ///< false: the stored row differs
};

/// Solves a point of a study again, in this process if the study is in a database file or --local
/// is given, else by a worker of the server, and compares it with the stored row. Throws
/// std::runtime_error if the point failed, has no answer or does not exist, InputError for
/// contradicting flags, and what the source throws.
SolvedAgain solve_again(Console& console, const PointSource& from, const std::string& study,
                        std::uint64_t point, const TraceOptions& options,
                        const std::function<void(const solver::TraceShape&)>& begin,
                        const solver::Tracing::Sink& row, bool shows_status = true);

/// Moves the rows of the fall out of a trace: from release (at minus the time of the fall) to
/// touch. The contact stays.
std::vector<solver::TraceRow> take_fall(std::vector<solver::TraceRow>& rows);

/// Formats of a trace; see format_of_output.
inline constexpr std::array<std::string_view, 2> kTraceFormats{"csv", "json"};

/// Writes a trace to a file (AtomicFile) or, if that is empty, to standard output.
class TraceOutput {
 public:
  /// Throws solver::InputError with `flag` if the file cannot be written.
  TraceOutput(const std::string& file, Format format, std::string_view flag = "--out");

  /// Whether its rows go to the terminal that shows progress.
  bool fills_terminal() const { return fills_terminal_; }

  void begin(const solver::TraceShape& shape);
  void add(const solver::TraceRow& row);
  /// JSON also contains the point and its result, if any. Throws std::runtime_error if the output
  /// is incomplete.
  void finish(const PointSpec& point, const std::optional<solver::CaseResult>& result);

 private:
  Format format_;
  bool fills_terminal_;
  std::unique_ptr<Sink> sink_;
  solver::TraceShape shape_;
  std::string text_;                 // CSV that is not written yet
  std::size_t rows_ = 0;             // of JSON
  std::vector<double> numbers_;      // of all rows, for JSON
  std::vector<std::string> states_;  // likewise
};

}  // namespace oblique::client
