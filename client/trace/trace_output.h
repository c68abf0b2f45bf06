#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/formats/sink.h"
#include "client/trace/point_at_hand.h"
#include "worker/solver/model/case_result.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::client {

enum class TraceFormat { kCsv, kJson };

/// The format that a flag names or, where it is empty, the end of the file's name; CSV unless told.
/// Throws solver::InputError for other names, and for a file whose name ends as another format.
TraceFormat trace_format(const std::string& flag, const std::string& file);
/// Names of all.
std::span<const std::string_view> trace_format_names();

/// Where a trace goes: a file, which appears whole at the end only, or, where that is empty,
/// standard output.
class TraceOutput {
 public:
  /// `flag` named the file. Throws solver::InputError when the file cannot be written.
  TraceOutput(std::string file, TraceFormat format, std::string_view flag = "--out");

  /// Whether its rows come to where progress is shown.
  bool fills_terminal() const;

  void begin(const solver::TraceShape& shape);
  void add(const solver::TraceRow& row);
  /// JSON has the point and its result, which may be missing, too. Throws std::runtime_error when
  /// not all could be written.
  void finish(const PointAtHand& point, const std::optional<solver::CaseResult>& result);

 private:
  void print_json(const PointAtHand& point, const std::optional<solver::CaseResult>& result);

  std::string path_;
  TraceFormat format_;
  std::unique_ptr<Sink> sink_;
  solver::TraceShape shape_;
  std::size_t rows_ = 0;
  std::vector<double> numbers_;      // of all rows, for JSON
  std::vector<std::string> states_;  // likewise
};

}  // namespace oblique::client
