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

/// Returns a function that solves falls in this process to check whether the tip reaches an H. The
/// console must outlive the function.
ReachCheck tip_reach(Console& console);

/// Returns the largest drop [m] of the tip. If it solves the fall, shows the progress on `line`.
double largest_drop_m(const solver::Finger& finger, StatusLine& line);

/// A point that this process solves.
struct PointToSolve {
  double H_m = 0.0;
  double mu = 0.0;
  double e_star = 0.0;
  bool errors = false;  ///< also estimates errors
};

/// Solves the point in this process and passes its instants to `tracing`. With `shows_status`,
/// shows a status line on the terminal, which must have no other output. If errors cannot be
/// estimated, prints a note instead. Throws as Finger::solve does.
solver::CaseResult solve_here(Console& console, const solver::Finger& finger,
                              const PointToSolve& point, const solver::Tracing& tracing,
                              bool shows_status = true);

/// A point of a study with all data needed to solve it.
struct PointSpec : PointToSolve {
  std::string study;
  std::uint64_t point = 0;
  solver::ModelParameters model;
};

/// Flags that select a point of a study and where it is solved again.
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
  std::uint64_t every = 1;         ///< keeps every K-th instant and all phase ends; 0: automatic
  std::int64_t time_limit_ms = 0;  ///< 0: the server's default
};

struct SolvedAgain {
  PointSpec point;
  std::optional<solver::CaseResult> result = {};  ///< empty if a worker sent unknown outputs
  std::string solver;                             ///< "here" or "by worker ann (avx2)"
  std::uint64_t every = 1;                        ///< the value of K that was used
  std::string comparison = {};  ///< comparison with the stored row: "same as stored"
  bool is_confirmed = true;     ///< false if the stored row differs
};

/// Solves a point of a study again and compares it with the stored row. It is solved in this
/// process if the study is in a database file or --local is given, else by a worker of the server.
/// Throws std::runtime_error if the point failed, is not solved or does not exist, InputError for
/// contradicting flags, and the errors of the source.
SolvedAgain solve_again(Console& console, const PointSource& from, const std::string& study,
                        std::uint64_t point, const TraceOptions& options,
                        const std::function<void(const solver::TraceShape&)>& begin,
                        const solver::Tracing::Sink& row, bool shows_status = true);

/// Moves the rows of the fall out of a trace: from release (at minus the time of the fall) to
/// touch. The rows of the contact remain in the trace.
std::vector<solver::TraceRow> take_fall(std::vector<solver::TraceRow>& rows);

/// Formats of a trace; see format_of_output.
inline constexpr std::array<std::string_view, 2> kTraceFormats{"csv", "json"};

/// Writes a trace to a file (AtomicFile), or to standard output if the file name is empty.
class TraceOutput {
 public:
  /// Throws solver::InputError that names `flag` if the file cannot be written.
  TraceOutput(const std::string& file, Format format, std::string_view flag = "--out");

  /// Whether the rows go to the terminal that also shows progress.
  bool fills_terminal() const { return fills_terminal_; }

  void begin(const solver::TraceShape& shape);
  void add(const solver::TraceRow& row);
  /// Ends the output. JSON also contains the point and, if given, its result. Throws
  /// std::runtime_error if the output is incomplete.
  void finish(const PointSpec& point, const std::optional<solver::CaseResult>& result);

 private:
  Format format_;
  bool fills_terminal_;
  std::unique_ptr<Sink> sink_;
  solver::TraceShape shape_;
  std::string text_;                 // CSV that is not yet written
  std::size_t rows_ = 0;             // of JSON
  std::vector<double> numbers_;      // numbers of all rows, one row after the other, for JSON
  std::vector<std::string> states_;  // states of all rows, for JSON
};

}  // namespace oblique::client
