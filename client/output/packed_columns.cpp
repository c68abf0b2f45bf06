#include "client/output/packed_columns.h"

#include <algorithm>
#include <array>
#include <utility>

namespace oblique::client {
namespace {

using nlohmann::ordered_json;
using Members = std::span<const std::string_view>;

// As the database's views of the same lists call them.
constexpr std::array<std::string_view, 4> kPeak{"t_s", "fn_N", "ft_N", "major"};
constexpr std::array<std::string_view, 2> kTangentialPeak{"t_s", "ft_N"};
constexpr std::array<std::string_view, 3> kPhase{"kind", "t0_s", "t1_s"};
constexpr std::array<std::string_view, 2> kReactionPeak{"t_s", "force_N"};

constexpr std::array<PackedColumn, 10> kColumns{{
    {"peaks", kPeak},
    {"ft_peaks", kTangentialPeak},
    {"phases", kPhase},
    {"reaction_peaks", kReactionPeak},
    {"stick_intervals", {}},
    {"lengths_m", {}},
    {"stick_intervals_s", {}},
    {"fn_peaks_N", {}},
    {"ft_peaks_N", {}},
    {"major_peaks_N", {}},
}};

bool is_plain(const ordered_json& value) {
  return value.is_primitive();
}

// A list of plain values, or of lists of them: nothing that the database packs goes deeper.
bool is_list(const ordered_json& value) {
  return value.is_array() && std::all_of(value.begin(), value.end(), [](const auto& element) {
           return is_plain(element) ||
                  (element.is_array() && std::all_of(element.begin(), element.end(), is_plain));
         });
}

std::optional<ordered_json> named(const ordered_json& list, Members members) {
  ordered_json objects = ordered_json::array();
  for (const auto& element : list) {
    if (!element.is_array() || element.size() != members.size()) {
      return std::nullopt;
    }
    ordered_json object = ordered_json::object();
    for (std::size_t i = 0; i < members.size(); ++i) {
      object[std::string(members[i])] = element[i];
    }
    objects.push_back(std::move(object));
  }
  return std::optional<ordered_json>(std::in_place, std::move(objects));
}

}  // namespace

std::span<const PackedColumn> packed_columns() {
  return kColumns;
}

std::optional<ordered_json> unpacked(std::string_view column, const std::string& text) {
  const auto found = std::find_if(kColumns.begin(), kColumns.end(),
                                  [&](const PackedColumn& each) { return each.name == column; });
  if (found == kColumns.end()) {
    return std::nullopt;
  }
  auto list = ordered_json::parse(text, nullptr, false);
  if (list.is_discarded() || !is_list(list)) {
    return std::nullopt;
  }
  if (!found->members.empty()) {
    return named(list, found->members);
  }
  return std::optional<ordered_json>(std::in_place, std::move(list));
}

}  // namespace oblique::client
