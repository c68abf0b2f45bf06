#include "client/explore/measurements.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/text.h"
#include "proto/wire/chunk.h"
#include "server/query/columns.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

using solver::InputError;

constexpr std::string_view kDeviation = "_sd";

/// Whether a column of results has numbers.
bool is_output(std::string_view name) {
  const auto* column = server::find_column(name);
  return column != nullptr && column->kind == "output" &&
         (column->values == protocol::CellKind::kReal ||
          column->values == protocol::CellKind::kInteger);
}

bool has_column(const CsvFile& file, std::string_view name) {
  return std::ranges::count(file.columns(), name) > 0;
}

/// Whether a column has the deviations of another column of the file.
bool is_deviation(const CsvFile& file, std::string_view name) {
  return name.ends_with(kDeviation) &&
         has_column(file, name.substr(0, name.size() - kDeviation.size()));
}

/// Returns the key that a column contains, or an empty text. The column of the key E is E_Pa.
std::string key_of_column(const std::string& name) {
  if (name == server::column_of_key("E")) {
    return "E";
  }
  return protocol::is_axis_key(name) ? name : "";
}

[[noreturn]] void refuse_column(const std::string& name) {
  std::vector<std::string_view> known;
  for (const auto& column : server::all_columns()) {
    if (is_output(column.name) || column.kind == "input") {
      known.push_back(column.name);
    }
  }
  throw InputError(
      fmt::format("the measurements have a column `{}`{}: columns are H, mu, e, model keys, "
                  "outputs with one number (`oblique columns`), and <output>_sd beside an output",
                  protocol::excerpt(name), protocol::did_you_mean(name, known)));
}

void add_numbers(const CsvFile& file, double relative_sd, Measurements& measured) {
  const std::string& column = measured.outputs.back();
  const auto values = file.numbers(column);
  const auto name_of_sd = fmt::format("{}{}", column, kDeviation);
  const auto deviations = has_column(file, name_of_sd)
                              ? file.numbers(name_of_sd)
                              : std::vector<std::optional<double>>(values.size());
  measured.rows = values.size();
  for (std::size_t row = 0; row < values.size(); ++row) {
    if (!values[row]) {
      continue;
    }
    const double sd = deviations[row].value_or(relative_sd * std::abs(*values[row]));
    const auto name = fmt::format("{}: {}", file.place_of_row(row), column);
    if (!(sd > 0.0)) {
      throw InputError(fmt::format("{} {}: fill in the column {}{}", name,
                                   deviations[row] ? "has a standard deviation that is not positive"
                                   : relative_sd > 0.0 ? "is 0, so --sd gives no standard deviation"
                                                       : "has no standard deviation",
                                   name_of_sd, relative_sd > 0.0 ? "" : ", or give --sd 1%"));
    }
    measured.numbers.push_back({row, measured.outputs.size() - 1, *values[row], sd, name});
  }
}

}  // namespace

Measurements read_measurements(const CsvFile& file, double relative_sd) {
  Measurements measured;
  for (const std::string& column : file.columns()) {
    if (const auto key = key_of_column(column); !key.empty()) {
      measured.conditions.emplace_back(key, file.values(column, protocol::axis_key(key)));
    } else if (is_output(column)) {
      measured.outputs.push_back(column);
      add_numbers(file, relative_sd, measured);
    } else if (!is_deviation(file, column)) {
      refuse_column(column);
    }
  }
  if (measured.numbers.empty()) {
    throw InputError(
        "the measurements have no measured output: name a column as one of `oblique columns`, such "
        "as fn_peak_N");
  }
  return measured;
}

}  // namespace oblique::client
