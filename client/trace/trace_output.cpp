#include "client/trace/trace_output.h"

#include <unistd.h>

#include <array>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/output/case_report.h"
#include "client/output/trace_table.h"
#include "proto/suggestion.h"
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

TraceFormat trace_format(const std::string& flag, const std::string& file) {
  if (!flag.empty()) {
    if (const auto format = format_called(flag)) {
      return *format;
    }
    throw solver::InputError(fmt::format("--format {} is not allowed: it must be one of {}{}", flag,
                                         protocol::joined(kFormats),
                                         protocol::did_you_mean(flag, kFormats)));
  }
  const std::string ending = std::filesystem::path(file).extension().string();
  if (file.empty() || ending.empty()) {
    return TraceFormat::kCsv;
  }
  if (const auto format = format_called(ending.substr(1))) {
    return *format;
  }
  throw solver::InputError(
      fmt::format("--out {} does not say in which format: end its name in .csv or .json, or give "
                  "--format",
                  file));
}

TraceOutput::TraceOutput(std::string file, TraceFormat format)
    : path_(std::move(file)), format_(format) {
  if (!path_.empty()) {
    file_.open(path_);
    if (!file_) {
      throw solver::InputError("cannot write the trace to " + path_);
    }
  }
}

TraceOutput::~TraceOutput() {
  if (!path_.empty() && !is_finished_) {
    file_.close();
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path_, ignored)) {
      std::filesystem::remove(path_, ignored);
    }
  }
}

std::ostream& TraceOutput::out() {
  return path_.empty() ? std::cout : file_;
}

bool TraceOutput::fills_terminal() const {
  return path_.empty() && isatty(STDOUT_FILENO) == 1;
}

void TraceOutput::begin(const solver::TraceShape& shape) {
  shape_ = shape;
  if (format_ == TraceFormat::kCsv) {
    print_trace_header(out(), shape);
  }
}

void TraceOutput::add(const solver::TraceRow& row) {
  ++rows_;
  if (format_ == TraceFormat::kCsv) {
    print_trace_row(out(), row);
    return;
  }
  solver::append_numbers(row, numbers_);
  states_.push_back(row.state);
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
  out() << all.dump(-1, ' ', true) << '\n';
}

void TraceOutput::finish(const PointAtHand& point,
                         const std::optional<solver::CaseResult>& result) {
  if (format_ == TraceFormat::kJson) {
    print_json(point, result);
  }
  if (!out().flush()) {
    throw std::runtime_error("the trace could not be written whole to " +
                             (path_.empty() ? "standard output" : path_));
  }
  is_finished_ = true;
}

}  // namespace oblique::client
