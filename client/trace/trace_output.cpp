#include "client/trace/trace_output.h"

#include <unistd.h>

#include <utility>
#include <variant>

#include <nlohmann/json.hpp>

#include "client/io/case_report.h"
#include "client/io/row_output.h"
#include "client/io/sink.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {

namespace {

/// One line of CSV for each instant.
void append_csv_row(std::string& text, const solver::TraceRow& row) {
  std::string_view separator;
  const auto put = [&](double value) {
    text.append(separator);
    append_number(text, value);
    separator = ",";
  };
  for (const auto& column : solver::trace_columns()) {
    if (const auto* number = std::get_if<double solver::TraceRow::*>(&column.value)) {
      put(row.*(*number));
    } else if (const auto* vectors = std::get_if<solver::TraceVectors>(&column.value)) {
      for (const double value : row.*(vectors->values)) {
        put(value);
      }
    } else {
      text.append(separator).append(row.*std::get<std::string solver::TraceRow::*>(column.value));
    }
  }
  text += '\n';
}

}  // namespace

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
    text_ += fmt::format("{}\n", fmt::join(solver::trace_headings(shape), ","));
  }
}

void TraceOutput::add(const solver::TraceRow& row) {
  constexpr std::size_t kLong = std::size_t{64} << 10U;
  if (format_ == Format::kCsv) {
    append_csv_row(text_, row);
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
