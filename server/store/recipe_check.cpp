#include "server/store/recipe_check.h"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/canonical.h"

namespace oblique::server {

std::string RecipeCheck::fault_of(const Statement& row) {
  const auto number = static_cast<std::uint64_t>(row.integer(0));  // below 0: beyond all
  if (number >= table_.size()) {
    return "the study has no such point";
  }
  if (!table_.is_left_in(number)) {
    return "the study's filter leaves it out, and it has a row";
  }
  const protocol::Point point = table_.point(number);
  int column = 2;
  for (const auto& [key, value] :
       {std::pair("H", point.H_m), {"mu", point.mu}, {"e", point.e_star}}) {
    if (row.real(column) != value) {
      return fmt::format("{} is {:.17g}, and {:.17g} in the recipe", key, row.real(column), value);
    }
    ++column;
  }
  if (!model_ || model_->number != point.model) {
    model_ = {point.model, protocol::canonical_model(table_.model(point.model)), -1};
  }
  if (const std::int64_t model_id = row.integer(1); model_id != model_->good_id) {
    definition_.bind(1, model_id);
    const bool agrees = definition_.step() && definition_.text(0) == model_->definition;
    definition_.reset();
    if (!agrees) {
      return "its model is not that of the recipe";
    }
    model_->good_id = model_id;
  }
  return {};
}

}  // namespace oblique::server
