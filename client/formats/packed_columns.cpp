#include "client/formats/packed_columns.h"

#include <algorithm>
#include <utility>

#include "worker/solver/model/result_fields.h"

namespace oblique::client {
namespace {

using nlohmann::ordered_json;
using Members = std::span<const std::string_view>;

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

std::optional<PackedList> packed_list(std::string_view column) {
  const auto* list = solver::find_result_list(column);
  bool is_part = false;
  if (const auto* field = solver::find_result_column(column)) {
    if (const auto* part = std::get_if<solver::ListPart>(&field->value)) {
      list = part->list;
      is_part = !part->member.empty();
    }
  }
  if (list != nullptr) {
    return PackedList{list->has_names && !is_part ? list->members : Members()};
  }
  return column == "lengths_m" ? std::optional(PackedList()) : std::nullopt;
}

std::optional<ordered_json> unpacked(const PackedList& packed, std::string_view text) {
  auto list = ordered_json::parse(text.begin(), text.end(), nullptr, false);
  if (list.is_discarded() || !is_list(list)) {
    return std::nullopt;
  }
  if (!packed.members.empty()) {
    return named(list, packed.members);
  }
  return std::optional<ordered_json>(std::in_place, std::move(list));
}

}  // namespace oblique::client
