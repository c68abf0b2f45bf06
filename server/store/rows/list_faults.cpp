#include "server/store/rows/list_faults.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "server/store/rows/stored_units.h"

namespace oblique::server {
namespace {

using Json = nlohmann::json;
using Rows = std::vector<std::vector<double>>;
using Lists = std::map<std::string_view, Rows>;  // by column
using solver::PhaseKind;
using solver::ResultList;

/// Columns that say what the arrays say, too; these follow them.
constexpr std::array<std::string_view, 5> kOutputs{"duration_s", "fn_peak_N", "ft_peak_N",
                                                   "stick_total_s", "mode"};
enum : int { kDuration, kFnPeak, kFtPeak, kStickTotal, kMode };

/// A finite number, or the number of a kind of phase.
std::optional<double> number_of(const Json& value) {
  if (value.is_number() && std::isfinite(value.get<double>())) {
    return value.get<double>();
  }
  for (const PhaseKind kind : {PhaseKind::kCompression, PhaseKind::kRestitution}) {
    if (value.is_string() && value.get_ref<const std::string&>() == phase_kind_name(kind)) {
      return static_cast<double>(kind);
    }
  }
  return std::nullopt;
}

/// The elements of a packed list; nothing when the text is none.
std::optional<Rows> elements_of(const ResultList& list, const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_array()) {
    return std::nullopt;
  }
  Rows rows;
  for (const Json& item : json) {
    if (!item.is_array() || item.size() != list.members.size()) {
      return std::nullopt;
    }
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < item.size(); ++i) {
      const auto number = number_of(item[i]);
      if (!number || item[i].is_string() != (list.members[i] == "kind")) {
        return std::nullopt;
      }
      row.push_back(*number);
    }
  }
  return rows;
}

bool ascends(const Rows& rows) {
  return std::is_sorted(rows.begin(), rows.end(),
                        [](const auto& a, const auto& b) { return a.front() < b.front(); });
}

/// Largest value of a column; 0 of none.
double largest(const Rows& rows, std::size_t column) {
  double value = 0.0;
  for (const auto& row : rows) {
    value = std::max(value, row[column]);
  }
  return value;
}

/// Sums and maxima of the solver may round otherwise than ours, and what is stored is rounded.
bool about(double a, double b, double rounding = 0.0) {
  constexpr double kRelative = 1e-9;
  return std::abs(a - b) <= rounding + kRelative * std::max(std::abs(a), std::abs(b));
}

/// Compressions and restitutions in turn, as "CRCR", by the states of a mode as "SC SR sR sC sR".
std::string turns_of(std::string_view mode) {
  std::string turns;
  for (const char letter : mode) {
    if ((letter == 'C' || letter == 'R') && (turns.empty() || turns.back() != letter)) {
      turns += letter;
    }
  }
  return turns;
}

/// The kinds of the phases as `turns_of` gives them; nothing unless they follow each other from 0.
std::optional<std::string> turns_of(const Rows& phases) {
  std::string turns;
  double end_s = 0.0;
  for (const auto& phase : phases) {
    if (phase[1] != end_s || !(phase[2] >= end_s)) {
      return std::nullopt;
    }
    turns += phase[0] == static_cast<double>(PhaseKind::kCompression) ? 'C' : 'R';
    end_s = phase[2];
  }
  return turns;
}

/// Why the arrays cannot be those of the outputs beside them.
std::string disagreement(const Statement& row, int first, const Lists& lists) {
  const Rows& phases = lists.at("phases");
  if (!about(phases.empty() ? 0.0 : phases.back()[2], row.real(first + kDuration))) {
    return "its phases do not end with its duration";
  }
  if (turns_of(phases) != turns_of(row.text(first + kMode))) {
    return "its phases are not those of its mode";
  }
  if (!about(largest(lists.at("peaks"), 1), row.real(first + kFnPeak))) {
    return "its fn_peak_N is not the largest of its peaks";
  }
  if (!about(largest(lists.at("ft_peaks"), 1), row.real(first + kFtPeak))) {
    return "its ft_peak_N is not the largest of its ft_peaks";
  }
  double stick_s = 0.0;
  for (const auto& interval : lists.at("stick_intervals")) {
    stick_s += interval[1] - interval[0];
  }
  const double roundings_s =
      static_cast<double>(2 * lists.at("stick_intervals").size() + 1) / kListTime.per_unit;
  return about(stick_s, row.real(first + kStickTotal), roundings_s)
             ? ""
             : "its stick_total_s is not that of its stick_intervals";
}

}  // namespace

std::string array_columns_sql(const std::string& when) {
  std::string columns(fmt::to_string(fmt::join(kOutputs, ", ")));
  for (const ResultList* list : solver::result_lists()) {
    columns += fmt::format(", CASE WHEN {} THEN {} END", when, list->column);
  }
  return columns;
}

std::string fault_of_arrays(const Statement& row, int first) {
  Lists lists;
  int column = first + static_cast<int>(kOutputs.size());
  for (const ResultList* list : solver::result_lists()) {
    const bool is_phases = list->column == "phases";
    const bool is_reactions = list->column == "reaction_peaks";
    const auto rows =
        is_reactions && row.is_null(column) ? Rows() : elements_of(*list, row.text(column));
    // Reactions stand in the order of the joints.
    const bool in_time = is_phases || is_reactions || !rows || ascends(*rows);
    if (!rows || !in_time || (is_phases && !turns_of(*rows))) {
      return fmt::format("its {} cannot be read{}", list->column,
                         is_phases ? ", or have gaps" : "");
    }
    lists.emplace(list->column, *rows);
    ++column;
  }
  return disagreement(row, first, lists);
}

}  // namespace oblique::server
