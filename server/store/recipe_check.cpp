#include "server/store/recipe_check.h"

#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"

namespace oblique::server {

std::string RecipeCheck::fault_of(const Statement& row) {
  const auto number = static_cast<std::uint64_t>(row.integer(0));  // large if negative
  if (number >= table_.size()) {
    return "the study has no such point";
  }
  const protocol::Point point = table_.point(number);
  int column = 2;
  for (const auto& [key, value] :
       {std::pair("H", point.H_m), {"mu", point.mu}, {"e", point.e_star}}) {
    if (!protocol::is_close(row.real(column), value)) {
      return fmt::format("{} is {:.17g}, and {:.17g} in the recipe", key, row.real(column), value);
    }
    ++column;
  }
  if (!model_ || model_->number != point.model) {
    model_ = {point.model, table_.model(point.model), -1};
  }
  if (const std::int64_t model_id = row.integer(1); model_id != model_->good_id) {
    if (!agrees(model_id)) {
      return "its model is not that of the recipe";
    }
    model_->good_id = model_id;
  }
  return {};
}

bool RecipeCheck::agrees(std::int64_t model_id) {
  definition_.bind(1, model_id);
  const std::string definition = definition_.step() ? definition_.text(0) : "";
  definition_.reset();
  try {
    return protocol::is_close(protocol::model_of_canonical(definition), model_->parameters);
  } catch (const std::runtime_error&) {  // it is missing or damaged
    return false;
  }
}

}  // namespace oblique::server
