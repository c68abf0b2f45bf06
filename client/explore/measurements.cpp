#include "client/explore/measurements.h"

#include <algorithm>
#include <cmath>
#include <map>
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

constexpr std::string_view kDeviationEnd = "_sd";

/// A column of a number that results have.
bool is_output(std::string_view name) {
  const auto* column = server::find_column(name);
  return column != nullptr && column->kind == "output" &&
         (column->values == protocol::CellKind::kReal ||
          column->values == protocol::CellKind::kInteger);
}

/// The output whose deviations a column has; empty: it has none.
std::string_view deviated_output(std::string_view name) {
  const auto output = name.substr(0, name.size() - std::min(name.size(), kDeviationEnd.size()));
  return name.ends_with(kDeviationEnd) && is_output(output) ? output : std::string_view();
}

/// The key whose values a column has, which queries call E_Pa for E; empty: it has none.
std::string key_of_column(const std::string& name) {
  for (const auto& key : solver::model_keys()) {
    if (name == key.name || name == server::column_of_key(key.name)) {
      return std::string(key.name);
    }
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
      fmt::format("the measurements have a column `{}`{}: columns are H, mu, e, keys of models, "
                  "outputs with one number "
                  "(`oblique columns` lists them), and <output>_sd",
                  protocol::excerpt(name), protocol::did_you_mean(name, known)));
}

/// A standard deviation, of the value or in its unit.
struct Deviation {
  double number;
  bool is_relative;
};

/// By output; the one with an empty name applies to outputs without their own.
std::map<std::string, Deviation, std::less<>> deviations_of(
    const std::vector<std::string>& texts, const std::vector<std::string>& outputs) {
  std::map<std::string, Deviation, std::less<>> deviations;
  for (const std::string& text : texts) {
    const auto equals = text.find('=');
    const std::string output = equals == std::string::npos ? "" : text.substr(0, equals);
    std::string_view number =
        std::string_view(text).substr(equals == std::string::npos ? 0 : equals + 1);
    const bool is_relative = number.ends_with('%');
    number.remove_suffix(is_relative ? 1 : 0);
    const auto value = solver::number_of(number);
    if (!value || !(*value > 0.0) || !std::isfinite(*value) || (output.empty() && !is_relative)) {
      throw InputError(fmt::format(
          "--sd {}: write 1% for all outputs, OUTPUT=2% or OUTPUT=VALUE, as fn_peak_N=50; "
          "deviations are positive",
          protocol::excerpt(text)));
    }
    if (!output.empty() && std::ranges::find(outputs, output) == outputs.end()) {
      const std::vector<std::string_view> known(outputs.begin(), outputs.end());
      throw InputError(fmt::format("--sd {}: the measurements have no output `{}`{}: they have {}",
                                   protocol::excerpt(text), protocol::excerpt(output),
                                   protocol::did_you_mean(output, known), protocol::joined(known)));
    }
    deviations[output] = {is_relative ? *value / 100.0 : *value, is_relative};
  }
  return deviations;
}

/// The deviation of a number without one in the file.
std::optional<double> usual_deviation(
    const std::map<std::string, Deviation, std::less<>>& deviations, const std::string& output,
    double value) {
  auto found = deviations.find(output);
  found = found == deviations.end() ? deviations.find("") : found;
  if (found == deviations.end()) {
    return {};
  }
  return found->second.is_relative ? found->second.number * std::abs(value) : found->second.number;
}

void check_deviation(const std::string& name, const std::string& output,
                     const std::optional<double>& sd) {
  if (!sd) {
    throw InputError(fmt::format(
        "{} has no standard deviation: fill in the column {}{}, or give --sd {}=VALUE or --sd 1%",
        name, output, kDeviationEnd, output));
  }
  if (!(*sd > 0.0)) {
    throw InputError(fmt::format(
        "{} has the standard deviation {}, which must be positive{}", name,
        solver::exact_number(*sd),
        *sd == 0.0 ? fmt::format(": give --sd {}=VALUE for a measured 0", output) : ""));
  }
}

}  // namespace

Measurements read_measurements(const CsvFile& file, const std::vector<std::string>& deviations) {
  Measurements measured;
  std::map<std::string, std::vector<std::optional<double>>, std::less<>> own_deviations;
  for (const std::string& column : file.columns()) {
    if (const auto key = key_of_column(column); !key.empty()) {
      measured.conditions.emplace_back(key, file.values(column, protocol::axis_key(key)));
    } else if (is_output(column)) {
      measured.outputs.push_back(column);
    } else if (const auto output = deviated_output(column); !output.empty()) {
      own_deviations.emplace(output, file.numbers(column));
    } else {
      refuse_column(column);
    }
  }
  const auto usual = deviations_of(deviations, measured.outputs);
  for (std::size_t output = 0; output < measured.outputs.size(); ++output) {
    const std::string& column = measured.outputs[output];
    const auto values = file.numbers(column);
    const auto own = own_deviations.find(column);
    measured.rows = values.size();
    for (std::size_t row = 0; row < values.size(); ++row) {
      if (!values[row]) {
        continue;
      }
      auto sd = own == own_deviations.end() ? std::nullopt : own->second[row];
      sd = sd ? sd : usual_deviation(usual, column, *values[row]);
      auto name = fmt::format("{}: {}", file.place_of_row(row), column);
      check_deviation(name, column, sd);
      measured.numbers.push_back({row, output, *values[row], *sd, std::move(name)});
    }
  }
  for (const auto& [output, unused] : own_deviations) {
    if (std::ranges::find(measured.outputs, output) == measured.outputs.end()) {
      throw InputError(fmt::format("the measurements have a column {}{} and none called {}", output,
                                   kDeviationEnd, output));
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
