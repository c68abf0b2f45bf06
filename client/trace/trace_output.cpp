#include "client/trace/trace_output.h"

#include <unistd.h>

#include <array>
#include <filesystem>
#include <string_view>
#include <utility>
#include <variant>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/formats/cell_text.h"
#include "client/formats/new_file.h"
#include "client/formats/row_printer.h"
#include "client/io/case_report.h"
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
    sink_->append(fmt::format("{}\n", fmt::join(solver::trace_headings(shape), ",")));
  }
}

void TraceOutput::add(const solver::TraceRow& row) {
  if (format_ == TraceFormat::kCsv) {
    append_csv_row(sink_->held(), row);
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
