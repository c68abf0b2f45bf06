#include "client/trace/point_at_hand.h"

#include <stdexcept>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/service/watching.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "server/asking/sql/sql_expression.h"

namespace oblique::client {
namespace {

/// The bytes of a blob that came as the text x'0F..'.
std::string bytes_of(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string bytes;
  if (!text.starts_with("x'") || !text.ends_with("'") || text.size() % 2 == 0) {
    return bytes;
  }
  text = text.substr(2, text.size() - 3);
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    bytes += static_cast<char>(kDigits.find(text[i]) * 16 + kDigits.find(text[i + 1]));
  }
  return bytes;
}

}  // namespace

PointAtHand point_in(Source& source, const std::string& study, std::uint64_t point) {
  const auto found = source.query(fmt::format(
      "SELECT CAST(recipe AS BLOB) FROM studies WHERE name = {}", server::sql_text(study)));
  if (found.rows_size() != 1) {
    study_named(source, study);  // says so
    throw std::runtime_error(fmt::format("the study \"{}\" has no recipe", study));
  }
  protocol::Recipe recipe;
  if (!recipe.ParseFromString(bytes_of(found.rows(0).values(0).text()))) {
    throw std::runtime_error(fmt::format("the recipe of the study \"{}\" is damaged", study));
  }
  const protocol::PointTable table(std::move(recipe));
  if (point >= table.size()) {
    throw std::runtime_error(fmt::format("the study \"{}\" has no point {}: its points are 0 to {}",
                                         study, point, table.size() - 1));
  }
  if (!table.is_left_in(point)) {
    throw std::runtime_error(
        fmt::format("point {} of the study \"{}\" is left out by its filter", point, study));
  }
  if (const std::string fault = table.fault(point); !fault.empty()) {
    throw std::runtime_error(fault);
  }
  const protocol::Point values = table.point(point);
  return {study,     point,         table.model(values.model), values.H_m,
          values.mu, values.e_star, table.wants_errors()};
}

PointAtHand point_of(const std::string& study, std::uint64_t point,
                     const protocol::TraceReply& reply) {
  return {study,         point,      protocol::from_message(reply.model()),
          reply.h_m(),   reply.mu(), reply.e_star(),
          reply.errors()};
}

}  // namespace oblique::client
