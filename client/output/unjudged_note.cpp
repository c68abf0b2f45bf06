#include "client/output/unjudged_note.h"

#include <cstddef>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/checks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

std::vector<std::uint64_t> unjudged_blocks(const protocol::Recipe& recipe) {
  const protocol::PointTable table(recipe);
  const auto model = protocol::from_message(recipe.model());
  std::vector<std::uint64_t> found;
  for (int i = 0; i < recipe.blocks_size(); ++i) {
    const auto number = static_cast<std::size_t>(i);
    const protocol::Block& block = recipe.blocks(i);
    if (block.where().empty() && table.block(number).points > protocol::PointTable::kMostCounted &&
        protocol::is_judged_by_points(model, block)) {
      found.push_back(number);
    }
  }
  return found;
}

void tell_unjudged(std::ostream& out, const protocol::Recipe& recipe) {
  const auto blocks = unjudged_blocks(recipe);
  if (blocks.empty()) {
    return;
  }
  const bool is_one = blocks.size() == 1;
  out << fmt::format(
      "Note: the values of block {}{} follow from its points, of which {} has more than {}: they "
      "were not judged. A point whose values are not allowed fails, and its error says why.\n",
      blocks.front() + 1, is_one ? "" : fmt::format(" and of {} more", blocks.size() - 1),
      is_one ? "it" : "each", protocol::PointTable::kMostCounted);
}

}  // namespace oblique::client
