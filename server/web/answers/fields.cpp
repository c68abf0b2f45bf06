#include "server/web/answers/fields.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/query/columns.h"
#include "server/query/sql_text.h"
#include "server/web/http/http_message.h"

namespace oblique::server {
bool is_text(const Fields& fields) {
  return std::all_of(fields.begin(), fields.end(), [](const auto& field) {
    return protocol::is_utf8(field.first) && protocol::is_utf8(field.second);
  });
}

std::optional<std::string> FieldReader::text(const std::string& name) const {
  const auto field = fields_.find(name);
  return field == fields_.end() || field->second.empty() ? std::nullopt
                                                         : std::optional(field->second);
}

std::optional<std::uint64_t> FieldReader::whole(const std::string& name) const {
  const auto field = text(name);
  if (!field) {
    return std::nullopt;
  }
  const auto number = read_number<std::uint64_t>(*field);
  if (!number) {
    throw std::invalid_argument(fmt::format("{} must be a whole number from 0", name));
  }
  return number;
}

std::optional<double> FieldReader::number(const std::string& name) const {
  const auto field = text(name);
  if (!field) {
    return std::nullopt;
  }
  const auto number = read_number<double>(*field);
  if (!number || !std::isfinite(*number)) {
    throw std::invalid_argument(fmt::format("{} must be a number", name));
  }
  return number;
}

std::uint64_t FieldReader::cells(const std::string& name, std::uint64_t usual) const {
  const std::uint64_t cells = whole(name).value_or(usual);
  if (cells < 1 || cells > kMaxCells) {
    throw std::invalid_argument(fmt::format("{} must be from 1 to {}", name, kMaxCells));
  }
  return cells;
}

std::string FieldReader::condition() const {
  const std::string condition = text("where").value_or("");
  if (!condition.empty()) {
    parse_request([&] { check_sql_part("--where", condition); });
  }
  return condition;
}

std::optional<PictureColumn> find_picture_column(std::string_view name) {
  constexpr std::array<std::string_view, 3> kCategories{"mode", "major_mode", "margin_event"};
  if (std::ranges::find(kCategories, name) != kCategories.end()) {
    return PictureColumn{std::string(name), "", true};
  }
  const auto& columns = all_columns();
  const auto column = std::ranges::find(columns, name, &Column::name);
  const bool is_quantity = column != columns.end() && column->kind != "row" &&
                           kind_of_values(name) != protocol::CellKind::kText;
  return is_quantity ? std::optional(PictureColumn{column->name, column->unit, false})
                     : std::nullopt;
}

}  // namespace oblique::server
