#include "client/trace/trace_output.h"

#include <unistd.h>

#include <array>
#include <filesystem>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/formats/new_file.h"
#include "client/formats/row_printer.h"
#include "client/output/case_report.h"
#include "client/output/trace_table.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr std::array<std::string_view, 2> kFormats{"csv", "json"};

std::optional<TraceFormat> format_called(std::string_view name) {
  return name == kFormats[0]   ? std::optional(TraceFormat::kCsv)
         : name == kFormats[1] ? std::optional(TraceFormat::kJson)
                               : std::nullopt;
}

}  // namespace

std::span<const std::string_view> trace_format_names() {
  return kFormats;
}

TraceFormat trace_format(const std::string& flag, const std::string& file) {
  const std::string ending = std::filesystem::path(file).extension().string();
  const auto of_file = format_called(std::string_view(ending).substr(ending.empty() ? 0 : 1));
  if (!flag.empty()) {
    const auto format = format_called(flag);
    if (!format) {
      throw solver::InputError(fmt::format("--format {} is not allowed: it must be one of {}{}",
                                           flag, protocol::joined(kFormats),
                                           protocol::did_you_mean(flag, kFormats)));
    }
    if (of_file && of_file != format) {
      throw solver::InputError(contradiction(flag, ending.substr(1), file));
    }
    return *format;
  }
  if (of_file || file.empty() || ending.empty()) {
    return of_file.value_or(TraceFormat::kCsv);
  }
  throw solver::InputError(
      fmt::format("--out {} does not say in which format: end its name in .csv or .json, or give "
                  "--format",
                  file));
}

TraceOutput::TraceOutput(std::string file, TraceFormat format, std::string_view flag)
    : path_(std::move(file)), format_(format) {
  if (!path_.empty()) {
    sink_ = std::make_unique<NewFile>(path_, flag);
    return;
  }
  sink_ = std::make_unique<StandardOutput>();
}

bool TraceOutput::fills_terminal() const {
  return path_.empty() && isatty(STDOUT_FILENO) == 1;
}

void TraceOutput::begin(const solver::TraceShape& shape) {
  shape_ = shape;
  if (format_ == TraceFormat::kCsv) {
    append_trace_header(sink_->held(), shape);
  }
}

void TraceOutput::add(const solver::TraceRow& row) {
  if (format_ == TraceFormat::kCsv) {
    append_trace_row(sink_->held(), row);
    sink_->flush_if_long();
  } else {
    ++rows_;
    solver::append_numbers(row, numbers_);
    states_.push_back(row.state);
  }
}

void TraceOutput::print_json(const PointAtHand& point,
                             const std::optional<solver::CaseResult>& result) {
  const std::size_t numbers = solver::trace_numbers(shape_);
  nlohmann::ordered_json columns;
  std::size_t place = 0;
  for (const auto& heading : solver::trace_headings(shape_)) {
    if (heading == "state") {
      columns[heading] = states_;
      continue;
    }
    auto& column = columns[heading] = nlohmann::ordered_json::array();
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
  sink_->append(all.dump(-1, ' ', true) + '\n');
}

void TraceOutput::finish(const PointAtHand& point,
                         const std::optional<solver::CaseResult>& result) {
  if (format_ == TraceFormat::kJson) {
    print_json(point, result);
  }
  sink_->finish();
}

}  // namespace oblique::client
