#include "server/study/study_table.h"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

using protocol::Block;
using protocol::Recipe;

Recipe parsed(const std::string& bytes) {
  Recipe recipe;
  if (!protocol::parse_recipe(bytes, recipe)) {
    throw std::runtime_error("its bytes are damaged or too many");
  }
  return recipe;
}

/// Returns whether `longer` only adds points to the sample of `block`, after the same first points.
bool is_larger_sample(const Block& block, const Block& longer) {
  if (!block.has_sample() || block.sample().kind() == protocol::SAMPLE_LATIN_HYPERCUBE ||
      longer.sample().count() <= block.sample().count()) {
    return false;
  }
  Block shortened = longer;
  shortened.mutable_sample()->set_count(block.sample().count());
  return protocol::is_same_block(block, shortened);
}

std::vector<std::string> head_differences(const Recipe& stored, const Recipe& given) {
  std::vector<std::string> lines;
  const auto was = protocol::from_message_unchecked(stored.model());
  const auto is = protocol::from_message_unchecked(given.model());
  for (const solver::ParameterKey& key : solver::model_keys()) {
    if (key.get(was) != key.get(is)) {
      lines.push_back(fmt::format("model, {}: stored {}, given {}", key.name,
                                  solver::exact_number(key.get(was)),
                                  solver::exact_number(key.get(is))));
    }
  }
  if (lines.empty() && protocol::canonical_model(was) != protocol::canonical_model(is)) {
    lines.emplace_back("model, lengths: the stored and the given ones differ");
  }
  if (stored.errors() != given.errors()) {
    lines.push_back(fmt::format("errors: stored {}, given {}", stored.errors(), given.errors()));
  }
  return lines;
}

Growth compare_blocks(const Recipe& stored, const Recipe& given) {
  const int common = std::min(stored.blocks_size(), given.blocks_size());
  int same = 0;
  while (same < common && protocol::is_same_block(stored.blocks(same), given.blocks(same))) {
    ++same;
  }
  if (same == stored.blocks_size()) {
    return {given.blocks_size() > same ? Growth::Kind::kLonger : Growth::Kind::kSame, {}};
  }
  if (same == given.blocks_size()) {
    return {Growth::Kind::kShorter,
            fmt::format("stored {} blocks, given {}", stored.blocks_size(), same)};
  }
  const Block& was = stored.blocks(same);
  const Block& is = given.blocks(same);
  if (same + 1 == stored.blocks_size() && is_larger_sample(was, is)) {
    return {Growth::Kind::kLonger, {}};
  }
  const std::string counts = fmt::format("block {}: stored a sample of {} points, given {}",
                                         same + 1, was.sample().count(), is.sample().count());
  if (same + 1 == given.blocks_size() && is_larger_sample(is, was)) {
    return {Growth::Kind::kShorter, counts};
  }
  if (was.sample().kind() == protocol::SAMPLE_LATIN_HYPERCUBE &&
      is.sample().kind() == protocol::SAMPLE_LATIN_HYPERCUBE &&
      was.sample().count() != is.sample().count()) {
    return {
        Growth::Kind::kOther,
        counts + ": the points of a Latin hypercube change with their number, so it cannot grow"};
  }
  return {Growth::Kind::kOther, fmt::format("block {} differs", same + 1)};
}

}  // namespace

Growth growth_of(const Recipe& stored, const Recipe& given) {
  Growth blocks = compare_blocks(stored, given);
  std::vector<std::string> lines = head_differences(stored, given);
  if (lines.empty()) {
    return blocks;
  }
  if (blocks.kind == Growth::Kind::kOther) {
    lines.push_back(blocks.difference);
  }
  return {Growth::Kind::kOther, fmt::format("{}", fmt::join(lines, "\n"))};
}

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
  if (recipe_bytes() == other.recipe_bytes()) {
    return {Growth::Kind::kSame, {}};
  }
  const auto recipe_in = [](const StudyTable& table, protocol::Recipe& own) -> const auto& {
    return table.is_made() ? table.get()->recipe() : own = parsed(table.recipe_bytes());
  };
  protocol::Recipe own;
  protocol::Recipe others;
  return growth_of(recipe_in(*this, own), recipe_in(other, others));
}

}  // namespace oblique::server
