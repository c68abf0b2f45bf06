#include "client/plot/data/study_axes.h"

#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "server/query/columns.h"

namespace oblique::client::plot {
namespace {

using protocol::Axis;
using protocol::Block;

bool are_listed(const Axis& axis) {
  return protocol::has_own_values(axis) && protocol::axis_size(axis) <= kMostListed;
}

/// Each once, rising.
void sort_out(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

std::vector<double> values_of(const Axis& axis) {
  std::vector<double> values(axis.values().begin(), axis.values().end());
  if (axis.count() > 0) {
    const protocol::RangeValues range(axis);
    for (std::uint64_t i = 0; i < axis.count(); ++i) {
      values.push_back(range.at(i));
    }
  }
  sort_out(values);
  return values;
}

/// Adds values that other blocks give to the same keys.
void unite_blocks(const protocol::Recipe& recipe, const Block& own, StudyShape& shape) {
  for (const Block& block : recipe.blocks()) {
    for (const Axis& axis : block.axes()) {
      for (StudyAxis& of_study : shape.axes) {
        if (&block != &own && of_study.key == axis.key() && are_listed(axis)) {
          const auto more = values_of(axis);
          of_study.all_values.insert(of_study.all_values.end(), more.begin(), more.end());
        }
      }
    }
  }
  for (StudyAxis& axis : shape.axes) {
    sort_out(axis.all_values);
  }
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

std::string column_of_key(const std::string& key) {
  if (const auto link = protocol::link_of_key(protocol::key_number(key))) {
    return fmt::format("json_extract(lengths_m, '$[{}]')", *link);
  }
  return server::column_of_key(key);
}

std::optional<BlockOfStudy> largest_block(const protocol::Recipe& recipe,
                                          const std::function<bool(const Block&)>& is_meant) {
  std::optional<BlockOfStudy> largest;
  BlockOfStudy each;
  for (const Block& block : recipe.blocks()) {
    each.points = protocol::points_of_block(block);
    if ((!largest || each.points > largest->points) && is_meant(block)) {
      largest = each;
    }
    each.first_point += each.points;
    ++each.number;
  }
  return largest;
}

StudyShape shape_of(const protocol::Recipe& recipe, const BlockOfStudy& block, bool is_alone) {
  const Block& own = recipe.blocks(static_cast<int>(block.number));
  StudyShape shape;
  shape.is_grid = protocol::block_kind(own) == protocol::BlockKind::kProduct;
  shape.block = block;
  shape.blocks = static_cast<std::size_t>(recipe.blocks_size());
  shape.is_one_block = is_alone && shape.blocks > 1;
  for (const Block& each : recipe.blocks()) {
    shape.points += protocol::points_of_block(each);
  }
  for (const Axis& axis : own.axes()) {
    StudyAxis of_study{.key = axis.key(), .column = column_of_key(axis.key())};
    of_study.is_listed = are_listed(axis);
    of_study.is_logarithmic = axis.count() > 0 && axis.spacing() == protocol::SPACING_LOGARITHMIC;
    if (of_study.is_listed) {
      of_study.values = values_of(axis);
      of_study.all_values = of_study.values;
    }
    shape.axes.push_back(std::move(of_study));
  }
  if (!shape.is_one_block) {
    unite_blocks(recipe, own, shape);
  }
  return shape;
}

}  // namespace oblique::client::plot
