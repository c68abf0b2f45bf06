#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace oblique::client {

/// Whether queries' column of that name may pack a list.
bool is_packed(std::string_view column);

/// The list that `text` of column `column` packs; elements with names become objects, as in
/// `solve --json`. Nothing where the column of queries is not packed or the text is not such a
/// list.
std::optional<nlohmann::ordered_json> unpacked(std::string_view column, const std::string& text);

}  // namespace oblique::client
