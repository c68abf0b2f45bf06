#include "client/plot/data/study_axes.h"

#include <algorithm>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/keys.h"
#include "worker/solver/model/errors.h"

namespace oblique::client::plot {
namespace {

using protocol::Axis;
using protocol::Block;

std::string column_of(const std::string& key) {
  if (const auto link = protocol::link_of_key(protocol::key_number(key))) {
    return fmt::format("json_extract(lengths_m, '$[{}]')", *link);
  }
  return key == "E" ? "E_Pa" : key;  // SQL does not tell E from e
}

bool are_listed(const Axis& axis) {
  return protocol::has_own_values(axis) && protocol::axis_size(axis) <= kMostListed;
}

std::vector<double> values_of(const Axis& axis) {
  std::vector<double> values(axis.values().begin(), axis.values().end());
  if (axis.count() > 0) {
    const protocol::RangeValues range(axis);
    for (std::uint64_t i = 0; i < axis.count(); ++i) {
      values.push_back(range.at(i));
    }
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

void unite_values(std::vector<double>& all, const std::vector<double>& more) {
  const auto middle = static_cast<std::ptrdiff_t>(all.size());
  all.insert(all.end(), more.begin(), more.end());
  std::inplace_merge(all.begin(), all.begin() + middle, all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
}

const Block& largest_block(const protocol::Recipe& recipe) {
  if (recipe.blocks().empty()) {
    throw solver::InputError("the study has no points");
  }
  const Block* largest = nullptr;
  std::uint64_t points = 0;
  for (const Block& block : recipe.blocks()) {
    const auto of_block = protocol::points_of_block(block);
    if (largest == nullptr || of_block > points) {
      largest = &block;
      points = of_block;
    }
  }
  return *largest;
}

}  // namespace

const StudyAxis* StudyShape::find(std::string_view name) const {
  const auto found = std::find_if(axes.begin(), axes.end(), [name](const StudyAxis& axis) {
    return axis.key == name || axis.column == name;
  });
  return found == axes.end() ? nullptr : &*found;
}

std::vector<const StudyAxis*> StudyShape::varying() const {
  std::vector<const StudyAxis*> found;
  for (const StudyAxis& axis : axes) {
    if (axis.varies()) {
      found.push_back(&axis);
    }
  }
  return found;
}

StudyShape shape_of(const protocol::Recipe& recipe) {
  const Block& largest = largest_block(recipe);
  StudyShape shape;
  shape.is_grid = protocol::block_kind(largest) == protocol::BlockKind::kProduct;
  shape.points = protocol::points_of_block(largest);
  for (const Axis& axis : largest.axes()) {
    StudyAxis of_study{.key = axis.key(), .column = column_of(axis.key())};
    of_study.is_listed = are_listed(axis);
    of_study.is_logarithmic = axis.count() > 0 && axis.spacing() == protocol::SPACING_LOGARITHMIC;
    if (of_study.is_listed) {
      of_study.values = values_of(axis);
      of_study.all_values = of_study.values;
    }
    shape.axes.push_back(std::move(of_study));
  }
  for (const Block& block : recipe.blocks()) {
    for (const Axis& axis : block.axes()) {
      for (StudyAxis& of_study : shape.axes) {
        if (&block != &largest && of_study.key == axis.key() && are_listed(axis)) {
          unite_values(of_study.all_values, values_of(axis));
        }
      }
    }
  }
  return shape;
}

}  // namespace oblique::client::plot
