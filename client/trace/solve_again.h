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

/// Checks by falls that are solved in this process whether the tip reaches an H. The console must
/// outlive it.
ReachCheck tip_reach(Console& console);

/// Largest drop of the tip; solves the fall if it is not solved yet and shows it on `line`.
double largest_drop_m(const solver::Finger& finger, StatusLine& line);

/// A point to solve in this process.
struct PointToSolve {
  double H_m = 0.0;
  double mu = 0.0;
  double e_star = 0.0;
  bool errors = false;  ///< estimate errors too
};

/// Solves the point in this process and passes its instants to `tracing`. `shows_status`: the
/// terminal is free for a status line. Errors that cannot be estimated are absent, with a note.
/// Throws as Finger::solve does.
solver::CaseResult solve_here(Console& console, const solver::Finger& finger,
                              const PointToSolve& point, const solver::Tracing& tracing,
                              bool shows_status = true);

/// A point of a study, with all that solving it needs.
struct PointSpec : PointToSolve {
  std::string study;
  std::uint64_t point = 0;
  solver::ModelParameters model;
};

/// Where a point of a study comes from and who solves it again.
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
  std::uint64_t every = 1;         ///< each such instant and all ends of phases; 0: as many as fit
  std::int64_t time_limit_ms = 0;  ///< 0: the server's own
};

/// A stored point, solved again.
struct SolvedAgain {
  PointSpec point;
  std::optional<solver::CaseResult> result = {};  ///< none: a worker sent outputs unknown here
  std::string solver;                             ///< "here" or "by worker ann (avx2)"
  std::uint64_t every = 1;      ///< rows have one in so many instants of the contact
  std::string comparison = {};  ///< with the stored row: "same as stored"
  bool is_confirmed = true;     ///< false: there is a row, and not with this result
};

/// Solves a point of a study again, here if the study is in a database file or --local is given,
/// else by a worker of the server, and compares it with the stored row. Throws std::runtime_error
/// for a point that failed, has no answer or does not exist, InputError for flags that contradict
/// each other, and what the source throws.
SolvedAgain solve_again(Console& console, const PointSource& from, const std::string& study,
                        std::uint64_t point, const TraceOptions& options,
                        const std::function<void(const solver::TraceShape&)>& begin,
                        const solver::Tracing::Sink& row, bool shows_status = true);

/// Moves the rows of the fall out of a trace: from release (its time is minus the time of the fall)
/// to touch. The contact is left.
std::vector<solver::TraceRow> take_fall(std::vector<solver::TraceRow>& rows);

/// Formats of a trace; see format_of_output.
inline constexpr std::array<std::string_view, 2> kTraceFormats{"csv", "json"};

/// Where a trace goes: a file (AtomicFile) or, where that is empty, standard output.
class TraceOutput {
 public:
  /// `flag` named the file. Throws solver::InputError when the file cannot be written.
  TraceOutput(const std::string& file, Format format, std::string_view flag = "--out");

  /// Whether its rows come to where progress is shown.
  bool fills_terminal() const { return fills_terminal_; }

  void begin(const solver::TraceShape& shape);
  void add(const solver::TraceRow& row);
  /// JSON contains the point and its result, which may be missing, too. Throws std::runtime_error
  /// when not all could be written.
  void finish(const PointSpec& point, const std::optional<solver::CaseResult>& result);

 private:
  Format format_;
  bool fills_terminal_;
  std::unique_ptr<Sink> sink_;
  solver::TraceShape shape_;
  std::string text_;                 // of CSV, not written yet
  std::size_t rows_ = 0;             // of JSON
  std::vector<double> numbers_;      // of all rows, for JSON
  std::vector<std::string> states_;  // likewise
};

}  // namespace oblique::client
