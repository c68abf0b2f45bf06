#include "server/store/packed_arrays.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace oblique::server {
namespace {

using Json = nlohmann::json;
using Rows = std::vector<std::vector<double>>;

/// A JSON array of arrays of `width` finite numbers; nothing when it is none.
std::optional<Rows> numbers_of(const Json& json, std::size_t width) {
  if (!json.is_array()) {
    return std::nullopt;
  }
  Rows rows;
  for (const Json& item : json) {
    if (!item.is_array() || item.size() != width) {
      return std::nullopt;
    }
    auto& row = rows.emplace_back();
    for (const Json& value : item) {
      if (!value.is_number() || !std::isfinite(value.get<double>())) {
        return std::nullopt;
      }
      row.push_back(value.get<double>());
    }
  }
  return rows;
}

Json parsed(const std::string& text) {
  return Json::parse(text, nullptr, false);
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

/// Sums and maxima of the solver may round otherwise than ours.
bool about(double a, double b) {
  constexpr double kRelative = 1e-9;
  return std::abs(a - b) <= kRelative * std::max(std::abs(a), std::abs(b));
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
std::optional<std::string> turns_of(const Json& phases, double& end_s) {
  if (!phases.is_array()) {
    return std::nullopt;
  }
  std::string turns;
  end_s = 0.0;
  for (const Json& phase : phases) {
    const bool is_phase = phase.is_array() && phase.size() == 3 && phase[0].is_string() &&
                          phase[1].is_number() && phase[2].is_number();
    if (!is_phase || phase[1].get<double>() != end_s || !(phase[2].get<double>() >= end_s)) {
      return std::nullopt;
    }
    const auto& kind = phase[0].get_ref<const std::string&>();
    if (kind != "compression" && kind != "restitution") {
      return std::nullopt;
    }
    turns += kind == "compression" ? 'C' : 'R';
    end_s = phase[2].get<double>();
  }
  return turns;
}

}  // namespace

std::string fault_of_arrays(const Statement& row, int first) {
  const double duration_s = row.real(first);
  const auto peaks = numbers_of(parsed(row.text(first + 5)), 4);
  const auto ft_peaks = numbers_of(parsed(row.text(first + 6)), 2);
  const auto sticks = numbers_of(parsed(row.text(first + 8)), 2);
  double end_s = 0.0;
  const auto turns = turns_of(parsed(row.text(first + 7)), end_s);
  if (!peaks || !ascends(*peaks)) {
    return "its peaks cannot be read";
  }
  if (!ft_peaks || !ascends(*ft_peaks)) {
    return "its ft_peaks cannot be read";
  }
  if (!turns) {
    return "its phases cannot be read, or have gaps";
  }
  if (!sticks || !ascends(*sticks)) {
    return "its stick_intervals cannot be read";
  }
  if (!row.is_null(first + 9) && !numbers_of(parsed(row.text(first + 9)), 2)) {
    return "its reaction_peaks cannot be read";
  }
  if (!about(end_s, duration_s)) {
    return "its phases do not end with its duration";
  }
  if (*turns != turns_of(row.text(first + 4))) {
    return "its phases are not those of its mode";
  }
  if (!about(largest(*peaks, 1), row.real(first + 1))) {
    return "its fn_peak_N is not the largest of its peaks";
  }
  if (!about(largest(*ft_peaks, 1), row.real(first + 2))) {
    return "its ft_peak_N is not the largest of its ft_peaks";
  }
  double stick_s = 0.0;
  for (const auto& interval : *sticks) {
    stick_s += interval[1] - interval[0];
  }
  return about(stick_s, row.real(first + 3)) ? ""
                                             : "its stick_total_s is not that of its "
                                               "stick_intervals";
}

}  // namespace oblique::server
