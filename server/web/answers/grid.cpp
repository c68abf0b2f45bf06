#include "server/web/answers/grid.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/text.h"

namespace oblique::server {
namespace {

using protocol::AxisLayout;

constexpr std::uint64_t kUsualCells = 256;

/// The axis of that key; null if the block has no such axis with values of its own.
const AxisLayout* find(const std::vector<AxisLayout>& axes, std::string_view key) {
  const auto axis = std::find_if(axes.begin(), axes.end(), [key](const AxisLayout& layout) {
    return layout.axis->key() == key && protocol::has_own_values(*layout.axis);
  });
  return axis == axes.end() ? nullptr : &*axis;
}

bool is_grid(const protocol::Block& block) {
  return protocol::block_kind(block) == protocol::BlockKind::kProduct;
}

std::size_t chosen_block(const protocol::PointTable& table, const FieldReader& fields,
                         const std::string& x, const std::string& y) {
  const protocol::Recipe& recipe = table.recipe();
  const auto blocks = static_cast<std::uint64_t>(recipe.blocks_size());
  if (const auto block = fields.whole("block")) {
    if (*block >= blocks || !is_grid(recipe.blocks(static_cast<int>(*block)))) {
      throw std::invalid_argument(
          fmt::format("block must be the number of a block whose axes multiply, below {}", blocks));
    }
    return *block;
  }
  for (std::uint64_t i = 0; i < blocks; ++i) {
    const protocol::Block& block = recipe.blocks(static_cast<int>(i));
    if (is_grid(block)) {
      const auto axes = protocol::layout_of(block);
      if (find(axes, x) != nullptr && (y.empty() || find(axes, y) != nullptr)) {
        return i;
      }
    }
  }
  throw std::invalid_argument(
      fmt::format("no block of the study has {}{} as axes that multiply: ask for bins",
                  protocol::excerpt(x), y.empty() ? "" : " and " + protocol::excerpt(y)));
}

/// Selects the values to show: all, or evenly spaced ones including both ends.
GridSide side_of(const AxisLayout& layout, const FieldReader& fields, const std::string& name) {
  GridSide side{layout.axis->key(), layout.values, 0, 0, layout.stride, {}, {}};
  side.first = fields.whole(name + "0").value_or(0);
  side.last = std::min(fields.whole(name + "1").value_or(side.of - 1), side.of - 1);
  if (side.first > side.last) {
    throw std::invalid_argument(
        fmt::format("{0}0 must be below {1}, the number of values of {2}, and at most {0}1", name,
                    side.of, side.key));
  }
  const std::uint64_t there = side.last - side.first + 1;
  const std::uint64_t shown = std::min(there, fields.cells("n" + name, kUsualCells));
  for (std::uint64_t i = 0; i < shown; ++i) {
    // Half is added to round to the nearest value.
    const std::uint64_t steps = shown > 1 ? shown - 1 : 1;
    const std::uint64_t number = side.first + (2 * i * (there - 1) + steps) / (2 * steps);
    side.numbers.push_back(shown > 1 ? number : side.first);
    side.values.push_back(protocol::axis_value(*layout.axis, side.numbers.back()));
  }
  return side;
}

/// The number of the nearest value; lists may have any order.
std::uint64_t nearest(const protocol::Axis& axis, double value) {
  const std::uint64_t size = protocol::axis_size(axis);
  if (axis.count() > 0) {
    const std::uint64_t above = std::min(protocol::first_value_from(axis, value), size - 1);
    const std::uint64_t below = above == 0 ? 0 : above - 1;
    return std::abs(protocol::axis_value(axis, below) - value) <
                   std::abs(protocol::axis_value(axis, above) - value)
               ? below
               : above;
  }
  const auto& values = axis.values();
  const auto found =
      std::min_element(values.begin(), values.end(), [value](double one, double other) {
        return std::abs(one - value) < std::abs(other - value);
      });
  return static_cast<std::uint64_t>(found - values.begin());
}

/// Parses one entry of `at`: KEY:VALUE selects the nearest value of the axis, KEY@NUMBER the value
/// of that number.
GridPlace place_of(const std::vector<AxisLayout>& axes, std::string_view text) {
  const std::size_t mark = text.find_first_of(":@");
  const std::string_view key = text.substr(0, mark);
  const AxisLayout* const axis = mark == std::string_view::npos ? nullptr : find(axes, key);
  const Fields entry{
      {"at", std::string(mark == std::string_view::npos ? "" : text.substr(mark + 1))}};
  const FieldReader reader(entry);
  if (axis == nullptr || !reader.text("at")) {
    throw std::invalid_argument(
        fmt::format("at must be KEY:VALUE or KEY@NUMBER of axes of the block, with commas between; "
                    "{} is none",
                    protocol::excerpt(text)));
  }
  const std::uint64_t number =
      text[mark] == '@' ? *reader.whole("at") : nearest(*axis->axis, *reader.number("at"));
  if (number >= axis->values) {
    throw std::invalid_argument(
        fmt::format("at: {} has the values 0 to {}", key, axis->values - 1));
  }
  return {std::string(key), axis->values, number, protocol::axis_value(*axis->axis, number)};
}

/// Parses all entries of `at`.
std::vector<GridPlace> places_at(const std::vector<AxisLayout>& axes, std::string_view at) {
  std::vector<GridPlace> places;
  while (!at.empty()) {
    const std::string_view one = at.substr(0, at.find(','));
    at.remove_prefix(std::min(at.size(), one.size() + 1));
    places.push_back(place_of(axes, one));
  }
  return places;
}

}  // namespace

std::vector<GridPlace> grid_places(const protocol::PointTable& table, const FieldReader& fields) {
  const std::string at = fields.text("at").value_or("");
  if (at.empty()) {
    return {};
  }
  const auto has_all = [&](const std::vector<AxisLayout>& axes) {
    for (const std::string_view one : protocol::split(at, ',')) {
      if (find(axes, one.substr(0, one.find_first_of(":@"))) == nullptr) {
        return false;
      }
    }
    return true;
  };
  std::vector<AxisLayout> axes;
  const auto meant = fields.whole("block");
  std::uint64_t number = 0;
  for (const protocol::Block& block : table.recipe().blocks()) {
    if (is_grid(block) && (meant ? number == *meant : !has_all(axes))) {
      axes = protocol::layout_of(block);
    }
    ++number;
  }
  return places_at(axes, at);
}

GridSlice grid_slice(const protocol::PointTable& table, const FieldReader& fields) {
  const std::string x = fields.text("x").value_or("");
  const std::string y = fields.text("y").value_or("");
  if (x.empty() || x == y) {
    throw std::invalid_argument("x must be an axis of the study, and y none or another one");
  }
  GridSlice slice{};
  slice.block = chosen_block(table, fields, x, y);
  const protocol::Block& block = table.recipe().blocks(static_cast<int>(slice.block));
  const std::vector<AxisLayout> axes = protocol::layout_of(block);
  const AxisLayout* const x_axis = find(axes, x);
  const AxisLayout* const y_axis = y.empty() ? nullptr : find(axes, y);
  if (x_axis == nullptr || (!y.empty() && y_axis == nullptr)) {
    throw std::invalid_argument(fmt::format("x and y must be axes of block {}", slice.block));
  }
  slice.x = side_of(*x_axis, fields, "x");
  slice.y.numbers = {0};
  if (y_axis != nullptr) {
    slice.y = side_of(*y_axis, fields, "y");
  }
  const std::vector<GridPlace> asked = places_at(axes, fields.text("at").value_or(""));
  slice.first_point = table.block(slice.block).first_point;
  for (const AxisLayout& axis : axes) {
    const std::string& key = axis.axis->key();
    if (key == x || key == y || !protocol::has_own_values(*axis.axis)) {
      continue;
    }
    const auto place =
        std::find_if(asked.begin(), asked.end(), [&](const GridPlace& p) { return p.key == key; });
    slice.at.push_back(place != asked.end()
                           ? *place
                           : GridPlace{key, axis.values, 0, protocol::axis_value(*axis.axis, 0)});
    slice.first_point += slice.at.back().number * axis.stride;
  }
  return slice;
}

}  // namespace oblique::server
