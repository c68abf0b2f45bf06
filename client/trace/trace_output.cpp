#include "client/trace/trace_output.h"

#include <unistd.h>

#include <utility>

#include <nlohmann/json.hpp>

#include "client/output/case_report.h"
#include "client/output/trace_table.h"

namespace oblique::client {

TraceOutput::TraceOutput(const std::string& file, Format format, std::string_view flag)
    : format_(format), fills_terminal_(file.empty() && isatty(STDOUT_FILENO) == 1) {
  if (file.empty()) {
    sink_ = std::make_unique<StandardOutput>();
  } else {
    sink_ = std::make_unique<AtomicFile>(file, flag);
  }
}

void TraceOutput::begin(const solver::TraceShape& shape) {
  shape_ = shape;
  if (format_ == Format::kCsv) {
    append_trace_header(text_, shape);
  }
}

void TraceOutput::add(const solver::TraceRow& row) {
  constexpr std::size_t kLong = std::size_t{64} << 10U;
  if (format_ == Format::kCsv) {
    append_trace_row(text_, row);
    if (text_.size() >= kLong) {
      sink_->append(std::exchange(text_, {}));
    }
  } else {
    ++rows_;
    solver::append_numbers(row, numbers_);
    states_.push_back(row.state);
  }
}

void TraceOutput::finish(const PointSpec& point, const std::optional<solver::CaseResult>& result) {
  if (format_ == Format::kJson) {
    const std::size_t numbers = solver::trace_numbers(shape_);
    nlohmann::ordered_json columns;
    std::size_t place = 0;
    for (const auto& heading : solver::trace_headings(shape_)) {
      auto& column = columns[heading] = nlohmann::ordered_json::array();
      if (heading == "state") {
        column = states_;
        continue;
      }
      for (std::size_t i = 0; i < rows_; ++i) {
        column.push_back(numbers_[i * numbers + place]);
      }
      ++place;
    }
    nlohmann::ordered_json all;
    all["study"] = point.study;
    all["point"] = point.point;
    all["result"] = result ? json_of(*result) : nlohmann::ordered_json();
    all["trace"] = std::move(columns);
    text_ = all.dump(-1, ' ', true) + '\n';
  }
  sink_->append(text_);
  sink_->finish();
}

}  // namespace oblique::client
