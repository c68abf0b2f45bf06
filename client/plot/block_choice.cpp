#include "client/plot/block_choice.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client::plot {
namespace {

using protocol::Axis;
using protocol::Block;

const Axis* axis_in(const Block& block, const std::string& name) {
  const auto found = std::find_if(block.axes().begin(), block.axes().end(), [&](const Axis& axis) {
    return axis.key() == name || column_of_key(axis.key()) == name;
  });
  return found == block.axes().end() ? nullptr : &*found;
}

bool varies(const Axis& axis) {
  return !protocol::has_own_values(axis) || protocol::axis_size(axis) > 1;
}

std::string key_of(const std::string& at) {
  return at.substr(0, at.find('='));
}

/// Whether a block has the value that KEY=VALUE gives; what is no number is judged later.
bool has_value(const Block& block, const std::string& at) {
  const Axis* const axis = axis_in(block, key_of(at));
  const auto equals = at.find('=');
  const auto value =
      equals == std::string::npos ? std::nullopt : solver::number_of(at.substr(equals + 1));
  if (axis == nullptr || !value || !protocol::has_own_values(*axis)) {
    return false;
  }
  const std::uint64_t values = std::min(protocol::axis_size(*axis), kMostListed);
  for (std::uint64_t i = 0; i < values; ++i) {
    if (std::abs(protocol::axis_value(*axis, i) - *value) <= 1e-5 * std::abs(*value)) {
      return true;
    }
  }
  return false;
}

/// The axes that are asked for; columns of results are none.
std::vector<std::string> axes_named(const protocol::Recipe& recipe, const PlotRequest& request) {
  std::vector<std::string> named;
  for (const std::string& name : {request.x, request.y, request.by}) {
    const bool is_axis =
        !name.empty() &&
        std::any_of(recipe.blocks().begin(), recipe.blocks().end(),
                    [&](const Block& block) { return axis_in(block, name) != nullptr; });
    if (is_axis) {
      named.push_back(name);
    }
  }
  return named;
}

/// Whether the picture can be one of that block alone.
bool suits(const Block& block, const PlotRequest& request, const std::vector<std::string>& named,
           bool has_what_is_held) {
  const auto varies_there = [&block](const std::string& name) {
    const Axis* const axis = axis_in(block, name);
    return axis != nullptr && varies(*axis);
  };
  if (!std::all_of(named.begin(), named.end(), varies_there)) {
    return false;
  }
  const auto open = std::count_if(block.axes().begin(), block.axes().end(), [&](const Axis& axis) {
    return varies(axis) && std::none_of(request.at.begin(), request.at.end(), [&](const auto& at) {
             return axis_in(block, key_of(at)) == &axis;
           });
  });
  if (open < (!request.map.empty() ? 2 : request.lines.empty() ? 0 : 1)) {
    return false;
  }
  return !has_what_is_held ||
         std::all_of(request.at.begin(), request.at.end(),
                     [&](const std::string& at) { return has_value(block, at); });
}

BlockOfStudy block_numbered(const protocol::Recipe& recipe, const std::string& text) {
  int number = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const int blocks = recipe.blocks_size();
  if (error != std::errc() || rest != text.data() + text.size() || number < 1 || number > blocks) {
    throw solver::InputError(fmt::format(
        "--block {} is not allowed: it must be {} or `all`; `oblique describe` shows them", text,
        blocks == 1 ? "1" : fmt::format("a number from 1 to {}", blocks)));
  }
  const Block* const meant = &recipe.blocks(number - 1);
  return *largest_block(recipe, [meant](const Block& block) { return &block == meant; });
}

/// Whether a picture of the block alone goes by its axes, and not by points wherever they lie.
bool goes_by_axes(const StudyShape& shape, const PlotRequest& request) {
  const PlotRequest drawn = completed(request, shape);
  return shape.is_grid && drawn.scatter.empty() && drawn.histogram.empty();
}

}  // namespace

StudyShape shape_for(const protocol::Recipe& recipe, const PlotRequest& request) {
  const bool has_all = request.block == "all";
  if (!request.block.empty() && !has_all) {
    return shape_of(recipe, block_numbered(recipe, request.block), true);
  }
  const auto largest = largest_block(recipe, [](const Block&) { return true; });
  if (!largest) {
    throw solver::InputError("the study has no points");
  }
  const auto named = axes_named(recipe, request);
  for (const bool has_what_is_held : {true, false}) {
    const auto chosen = largest_block(
        recipe, [&](const Block& block) { return suits(block, request, named, has_what_is_held); });
    if (!chosen) {
      continue;
    }
    StudyShape alone = shape_of(recipe, *chosen, true);
    return !has_all && goes_by_axes(alone, request) ? alone : shape_of(recipe, *chosen, false);
  }
  return shape_of(recipe, *largest, false);
}

std::string block_in_words(const StudyShape& shape) {
  return fmt::format("block {} of {}", shape.block.number + 1, shape.blocks);
}

}  // namespace oblique::client::plot
