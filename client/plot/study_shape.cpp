#include "client/plot/study_shape.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "server/query/columns.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

using protocol::Axis;
using protocol::Block;

/// Each once, rising.
void sort_out(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

std::string column_of_key(const std::string& key) {
  if (const auto link = protocol::link_of_key(protocol::key_number(key))) {
    return fmt::format("json_extract(lengths_m, '$[{}]')", *link);
  }
  return server::column_of_key(key);
}

StudyAxis study_axis(const Axis& axis) {
  StudyAxis of_study{.key = axis.key(), .column = column_of_key(axis.key())};
  of_study.is_listed = protocol::has_own_values(axis) && protocol::axis_size(axis) <= kMostListed;
  of_study.is_logarithmic = axis.count() > 0 && axis.spacing() == protocol::SPACING_LOGARITHMIC;
  if (of_study.is_listed) {
    of_study.values.assign(axis.values().begin(), axis.values().end());
    const std::uint64_t size = axis.count() > 0 ? protocol::axis_size(axis) : 0;
    for (std::uint64_t i = of_study.values.size(); i < size; ++i) {
      of_study.values.push_back(protocol::axis_value(axis, i));
    }
    sort_out(of_study.values);
    of_study.all_values = of_study.values;
  }
  return of_study;
}

std::vector<StudyAxis> axes_of(const Block& block) {
  std::vector<StudyAxis> axes;
  for (const Axis& axis : block.axes()) {
    axes.push_back(study_axis(axis));
  }
  return axes;
}

const StudyAxis* find_axis(const std::vector<StudyAxis>& axes, std::string_view name) {
  const auto found = std::find_if(axes.begin(), axes.end(),
                                  [name](const StudyAxis& axis) { return axis.is_named(name); });
  return found == axes.end() ? nullptr : &*found;
}

/// Adds values that other blocks give to the same keys.
void unite_blocks(const protocol::Recipe& recipe, StudyShape& shape) {
  for (const Block& block : recipe.blocks()) {
    for (const Axis& axis : block.axes()) {
      for (StudyAxis& of_study : shape.axes) {
        if (of_study.key == axis.key()) {
          const auto more = study_axis(axis).values;
          of_study.all_values.insert(of_study.all_values.end(), more.begin(), more.end());
        }
      }
    }
  }
  for (StudyAxis& axis : shape.axes) {
    sort_out(axis.all_values);
  }
}

StudyShape shape_of(const protocol::Recipe& recipe, const BlockOfStudy& block, bool is_alone) {
  const Block& own = recipe.blocks(static_cast<int>(block.number));
  StudyShape shape;
  shape.axes = axes_of(own);
  shape.is_grid = protocol::block_kind(own) == protocol::BlockKind::kProduct;
  shape.block = block;
  shape.blocks = static_cast<std::size_t>(recipe.blocks_size());
  shape.is_one_block = is_alone && shape.blocks > 1;
  for (const Block& each : recipe.blocks()) {
    shape.points += protocol::points_of_block(each);
  }
  if (!shape.is_one_block) {
    unite_blocks(recipe, shape);
  }
  return shape;
}

/// Whether the picture can be one of that block alone: the axes that are asked for vary in it,
/// those that --at leaves open suffice and, with `has_values`, it has the values of --at.
bool suits(const Block& block, const PlotRequest& request, const std::vector<std::string>& named,
           bool has_values) {
  const auto axes = axes_of(block);
  for (const std::string& name : named) {
    const StudyAxis* axis = find_axis(axes, name);
    if (axis == nullptr || !axis->varies()) {
      return false;
    }
  }
  auto open =
      std::count_if(axes.begin(), axes.end(), [](const StudyAxis& axis) { return axis.varies(); });
  for (const std::string& at : request.at) {
    const StudyAxis* axis = find_axis(axes, at.substr(0, at.find('=')));
    const auto value = solver::number_of(at.substr(std::min(at.find('='), at.size() - 1) + 1));
    const bool has_value =
        axis != nullptr && value &&
        std::any_of(axis->values.begin(), axis->values.end(), [&value](double each) {
          return std::abs(each - *value) <= 1e-5 * std::abs(*value);
        });
    if (has_values && !has_value) {
      return false;
    }
    open -= axis != nullptr && axis->varies() ? 1 : 0;
  }
  return open >= (!request.map.empty() ? 2 : request.lines.empty() ? 0 : 1);
}

/// All blocks, that with the most points first.
std::vector<BlockOfStudy> blocks_by_size(const protocol::Recipe& recipe) {
  std::vector<BlockOfStudy> blocks;
  BlockOfStudy each;
  for (const Block& block : recipe.blocks()) {
    each.points = protocol::points_of_block(block);
    blocks.push_back(each);
    each.first_point += each.points;
    ++each.number;
  }
  std::stable_sort(blocks.begin(), blocks.end(), [](const BlockOfStudy& a, const BlockOfStudy& b) {
    return a.points > b.points;
  });
  return blocks;
}

/// The names of axes that are asked for; columns of results are none.
std::vector<std::string> axes_named(const protocol::Recipe& recipe, const PlotRequest& request) {
  std::vector<std::string> named;
  for (const std::string& name : {request.x, request.y, request.by}) {
    const auto has_it = [&name](const Block& block) {
      return std::any_of(block.axes().begin(), block.axes().end(), [&name](const Axis& axis) {
        return axis.key() == name || column_of_key(axis.key()) == name;
      });
    };
    if (!name.empty() && std::any_of(recipe.blocks().begin(), recipe.blocks().end(), has_it)) {
      named.push_back(name);
    }
  }
  return named;
}

}  // namespace

const StudyAxis* StudyShape::find(std::string_view name) const {
  return find_axis(axes, name);
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

StudyShape shape_for(const protocol::Recipe& recipe, const PlotRequest& request) {
  const auto blocks = blocks_by_size(recipe);
  if (!request.block.empty() && request.block != "all") {
    std::size_t number = 0;
    const char* const end = request.block.data() + request.block.size();
    const auto [rest, error] = std::from_chars(request.block.data(), end, number);
    if (error != std::errc() || rest != end || number < 1 || number > blocks.size()) {
      throw solver::InputError(fmt::format(
          "--block {} is not allowed: it must be {} or `all`; `oblique describe` shows them",
          request.block,
          blocks.size() == 1 ? "1" : fmt::format("a number from 1 to {}", blocks.size())));
    }
    return shape_of(
        recipe,
        *std::find_if(blocks.begin(), blocks.end(),
                      [number](const auto& block) { return block.number + 1 == number; }),
        true);
  }
  if (blocks.empty()) {
    throw solver::InputError("the study has no points");
  }
  const auto named = axes_named(recipe, request);
  for (const bool has_values : {true, false}) {
    const auto chosen = std::find_if(blocks.begin(), blocks.end(), [&](const BlockOfStudy& block) {
      return suits(recipe.blocks(static_cast<int>(block.number)), request, named, has_values);
    });
    if (chosen != blocks.end()) {
      // Points and histograms show all blocks.
      StudyShape alone = shape_of(recipe, *chosen, true);
      const PlotRequest drawn = completed(request, alone);
      const bool goes_by_axes = alone.is_grid && drawn.scatter.empty() && drawn.histogram.empty();
      return request.block != "all" && goes_by_axes ? alone : shape_of(recipe, *chosen, false);
    }
  }
  return shape_of(recipe, blocks.front(), false);
}

}  // namespace oblique::client::plot
