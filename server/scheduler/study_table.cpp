#include "server/scheduler/study_table.h"

#include <stdexcept>
#include <utility>

namespace oblique::server {

StudyTable::StudyTable(std::shared_ptr<const protocol::PointTable> table)
    : shared_(std::make_shared<Shared>(
          Shared{table->recipe().SerializeAsString(), table->size(), nullptr})) {
  shared_->table = std::move(table);
}

StudyTable::StudyTable(std::string recipe_bytes, std::uint64_t points)
    : shared_(std::make_shared<Shared>(Shared{std::move(recipe_bytes), points, nullptr})) {}

const std::shared_ptr<const protocol::PointTable>& StudyTable::get() const {
  if (shared_->table == nullptr) {
    protocol::Recipe recipe;
    if (!recipe.ParseFromString(shared_->recipe_bytes)) {
      throw std::runtime_error("its bytes are damaged");
    }
    auto table = std::make_shared<const protocol::PointTable>(std::move(recipe));
    if (table->size() != shared_->points) {
      throw std::runtime_error("it has " + std::to_string(table->size()) +
                               " points, and the study " + std::to_string(shared_->points));
    }
    shared_->table = std::move(table);
  }
  return shared_->table;
}

}  // namespace oblique::server
