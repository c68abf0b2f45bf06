#pragma once

#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "client/trace/point_at_hand.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::client {

enum class TraceFormat { kCsv, kJson };

/// The format that a flag names or, where it is empty, the end of the file's name; CSV unless told.
/// Throws solver::InputError for other names.
TraceFormat trace_format(const std::string& flag, const std::string& file);

/// Where a trace goes: a file or, where that is empty, standard output.
class TraceOutput {
 public:
  /// Throws solver::InputError when the file cannot be written.
  TraceOutput(std::string file, TraceFormat format);
  /// A file that was not finished is removed.
  ~TraceOutput();
  TraceOutput(const TraceOutput&) = delete;
  TraceOutput& operator=(const TraceOutput&) = delete;

  /// Whether its rows come to where progress is shown.
  bool fills_terminal() const;

  void begin(const solver::TraceShape& shape);
  void add(const solver::TraceRow& row);
  /// `result` may be missing. Throws std::runtime_error when not all could be written.
  void finish(const PointAtHand& point, const std::optional<solver::CaseResult>& result);
  std::size_t rows() const { return rows_; }

 private:
  std::ostream& out();
  void print_json(const PointAtHand& point, const std::optional<solver::CaseResult>& result);

  std::string path_;
  TraceFormat format_;
  std::ofstream file_;
  solver::TraceShape shape_;
  std::size_t rows_ = 0;
  bool is_finished_ = false;
  std::vector<double> numbers_;      // of all rows, for JSON
  std::vector<std::string> states_;  // likewise
};

}  // namespace oblique::client
