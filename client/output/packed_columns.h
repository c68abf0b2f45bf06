#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace oblique::client {

/// A column that holds a list packed as JSON text.
struct PackedColumn {
  std::string_view name;
  /// What the numbers of one element are called, in their order; empty: elements have no names.
  std::span<const std::string_view> members;
};

/// Every column of queries that is packed.
std::span<const PackedColumn> packed_columns();

/// The list that `text` of column `column` packs; elements with names become objects, as in
/// `solve --json`. Nothing where the column is not packed or the text is not such a list.
std::optional<nlohmann::ordered_json> unpacked(std::string_view column, const std::string& text);

}  // namespace oblique::client
