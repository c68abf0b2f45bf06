#include "server/study/study_table.h"

#include <stdexcept>
#include <utility>

#include "proto/recipe/model_message.h"

namespace oblique::server {
namespace {

protocol::Recipe parsed(const std::string& bytes) {
  protocol::Recipe recipe;
  if (!protocol::parse_recipe(bytes, recipe)) {
    throw std::runtime_error("its bytes are damaged, or more than a recipe may have");
  }
  return recipe;
}

}  // namespace

StudyTable::StudyTable(std::shared_ptr<const protocol::PointTable> table)
    : shared_(std::make_shared<Shared>(
          Shared{table->recipe().SerializeAsString(), table->size(), nullptr})) {
  shared_->table = std::move(table);
}

StudyTable::StudyTable(std::string recipe_bytes, std::uint64_t points)
    : shared_(std::make_shared<Shared>(Shared{std::move(recipe_bytes), points, nullptr})) {}

const std::shared_ptr<const protocol::PointTable>& StudyTable::get() const {
  if (shared_->table == nullptr) {
    protocol::Recipe recipe = parsed(shared_->recipe_bytes);
    auto table = std::make_shared<const protocol::PointTable>(std::move(recipe));
    if (table->size() != shared_->points) {
      throw std::runtime_error("it has " + std::to_string(table->size()) +
                               " points, and the study " + std::to_string(shared_->points));
    }
    shared_->table = std::move(table);
  }
  return shared_->table;
}

Growth StudyTable::growth_to(const StudyTable& other) const {
  const auto recipe_in = [](const StudyTable& table, protocol::Recipe& own) -> const auto& {
    return table.is_made() ? table.get()->recipe() : own = parsed(table.recipe_bytes());
  };
  protocol::Recipe own;
  protocol::Recipe others;
  return growth_of(recipe_in(*this, own), recipe_in(other, others));
}

bool StudyTable::is_of_the_recipe_of(const StudyTable& other) const {
  if (recipe_bytes() == other.recipe_bytes()) {
    return true;
  }
  try {
    return size() == other.size() && growth_to(other).kind == Growth::Kind::kSame;
  } catch (const std::runtime_error&) {
    return false;  // one of them cannot be read, or only by another version
  }
}

}  // namespace oblique::server
