#pragma once

#include <optional>
#include <span>
#include <string_view>

#include <nlohmann/json.hpp>

namespace oblique::client {

/// A list that a column packs.
struct PackedList {
  std::span<const std::string_view> members;  ///< of an element; empty: they have no names
};

/// What queries' column of that name packs; nothing where it packs no list.
std::optional<PackedList> packed_list(std::string_view column);

/// The list that `text` packs; elements with names become objects, as in `solve --json`. Nothing
/// where the text is not such a list.
std::optional<nlohmann::ordered_json> unpacked(const PackedList& packed, std::string_view text);

}  // namespace oblique::client
