#include "server/study/study_table.h"

#include <stdexcept>
#include <utility>

#include "proto/recipe/canonical.h"
#include "proto/recipe/checks.h"

namespace oblique::server {
namespace {

protocol::Recipe parsed(const std::string& bytes) {
  protocol::Recipe recipe;
  if (!protocol::parse_recipe(bytes, recipe)) {
    throw std::runtime_error("its bytes are damaged, or more than a recipe may have");
  }
  return recipe;
}

/// Whether a message is another with blocks, and nothing else, put behind it. Messages of one kind
/// one behind the other are one: lists go on. As most studies grow; no look at what is there.
bool is_longer_by_blocks(const std::string& bytes, const std::string& longer) {
  protocol::Recipe rest;
  if (longer.size() <= bytes.size() || !longer.starts_with(bytes) ||
      !rest.ParseFromString(longer.substr(bytes.size())) || rest.blocks_size() == 0) {
    return false;
  }
  rest.clear_blocks();
  return rest.ByteSizeLong() == 0;
}

}  // namespace

StudyTable::StudyTable(std::shared_ptr<const protocol::PointTable> table)
    : shared_(std::make_shared<Shared>(Shared{table->recipe().SerializeAsString(), table->size(),
                                              nullptr, protocol::recipe_digest(table->recipe())})) {
  shared_->table = std::move(table);
}

StudyTable::StudyTable(std::string recipe_bytes, std::uint64_t points)
    : shared_(std::make_shared<Shared>(Shared{std::move(recipe_bytes), points, nullptr, {}})) {}

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

const protocol::Sha256::Digest& StudyTable::digest() const {
  if (!shared_->digest) {
    shared_->digest = protocol::recipe_digest(parsed(shared_->recipe_bytes));
  }
  return *shared_->digest;
}

Growth StudyTable::growth_to(const StudyTable& other) const {
  if (is_longer_by_blocks(recipe_bytes(), other.recipe_bytes())) {
    return {Growth::Kind::kLonger, {}};
  }
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
    return size() == other.size() && digest() == other.digest();
  } catch (const std::runtime_error&) {
    return false;  // one of them cannot be read, or only by another version
  }
}

}  // namespace oblique::server
