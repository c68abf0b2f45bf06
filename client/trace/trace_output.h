#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/io/row_output.h"
#include "client/io/sink.h"
#include "client/trace/worker_trace.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::client {

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
