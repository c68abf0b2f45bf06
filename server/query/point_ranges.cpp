#include "server/query/plan.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "proto/recipe/blocks.h"
#include "server/query/columns.h"
#include "server/query/sql_text.h"

namespace oblique::server {
namespace {

using Ranges = std::vector<PointRange>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// More ranges are merged into one, because the statement would be long and slow to start.
constexpr std::size_t kMostRanges = 20'000;
/// Conditions in more nested brackets than this are ignored.
constexpr int kDeepest = 50;

/// The range from the first point of `ranges`, which are not empty, to the last.
Ranges hull(const Ranges& ranges) {
  return {{ranges.front().first, ranges.back().last}};
}

struct Interval {
  double low = -kInfinity;
  double high = kInfinity;
};
/// The interval of each column that a condition restricts.
using Intervals = std::map<std::string, Interval, std::less<>>;

/// The number in `tokens`, with or without a sign; none if they are not a plain number.
std::optional<double> number_in(SqlTokens tokens) {
  const bool is_negative = !tokens.empty() && tokens[0].is_sign("-");
  if (is_negative || (!tokens.empty() && tokens[0].is_sign("+"))) {
    tokens = tokens.subspan(1);
  }
  const bool is_literal = tokens.size() == 1 && tokens[0].kind == SqlToken::Kind::kLiteral;
  const auto number = is_literal ? decimal_number(tokens[0].text) : std::nullopt;
  return number && is_negative ? std::optional(-*number) : number;
}

void restrict_column(Intervals& intervals, SqlTokens column, std::optional<double> low,
                     std::optional<double> high) {
  if (column.size() == 1 && column[0].kind == SqlToken::Kind::kName && low && high) {
    Interval& known = intervals[std::string(column[0].text)];
    known = {std::max(known.low, *low), std::min(known.high, *high)};
  }
}

/// Reads `column BETWEEN number AND number`, `column < number` and so on. Ignores other conditions.
void add_condition(Intervals& intervals, SqlTokens tokens) {
  if (tokens.size() > 2 && is_word(tokens[1], "between")) {
    const auto middle =
        std::ranges::find_if(tokens, [](const SqlToken& token) { return is_word(token, "and"); });
    if (middle != tokens.end()) {
      restrict_column(intervals, tokens.first(1), number_in({tokens.begin() + 2, middle}),
                      number_in({middle + 1, tokens.end()}));
    }
    return;
  }
  const bool is_comparison = tokens.size() > 2 && tokens[1].kind == SqlToken::Kind::kSign;
  const auto number = is_comparison ? number_in(tokens.subspan(2)) : std::nullopt;
  if (!number) {
    return;
  }
  const std::string_view sign = tokens[1].text;
  if (sign == "=" || sign == "==") {
    restrict_column(intervals, tokens.first(1), number, number);
  } else if (sign == "<" || sign == "<=") {
    restrict_column(intervals, tokens.first(1), -kInfinity, number);
  } else if (sign == ">" || sign == ">=") {
    restrict_column(intervals, tokens.first(1), number, kInfinity);
  }
}

/// Adds the conditions that `tokens` join with AND. Adds none if it cannot separate them.
void add_conjuncts(SqlTokens tokens, int depth, Intervals& intervals) {
  const bool is_in_brackets =
      !tokens.empty() && tokens[0].is_sign("(") && closing_bracket(tokens, 0) == tokens.size() - 1;
  if (is_in_brackets && depth < kDeepest) {
    add_conjuncts(tokens.subspan(1, tokens.size() - 2), depth + 1, intervals);
    return;
  }
  std::vector<SqlTokens> parts;
  std::size_t begin = 0;
  std::size_t open_betweens = 0;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (is_word(tokens[i], "or") || is_word(tokens[i], "case")) {
      return;  // not a conjunction
    }
    if (tokens[i].is_sign("(")) {
      i = std::min(closing_bracket(tokens, i), tokens.size() - 1);
    } else if (is_word(tokens[i], "between")) {
      ++open_betweens;
    } else if (is_word(tokens[i], "and") && open_betweens > 0) {
      --open_betweens;
    } else if (is_word(tokens[i], "and")) {
      parts.push_back(tokens.subspan(begin, i - begin));
      begin = i + 1;
    }
  }
  if (parts.empty()) {
    add_condition(intervals, tokens);
    return;
  }
  parts.push_back(tokens.subspan(begin));
  for (const SqlTokens part : parts) {
    add_conjuncts(part, depth, intervals);
  }
}

/// The interval to which an axis is restricted; nullptr: none, or the column depends on other axes.
const Interval* interval_of(const protocol::Axis& axis, const Intervals& intervals) {
  const auto found = intervals.find(column_of_key(axis.key()));
  // `length` is changed by axes of single lengths too, and `integrator` is a text.
  const bool is_own = protocol::has_own_values(axis) && !axis.key().starts_with("length") &&
                      axis.key() != "integrator";
  return found == intervals.end() || !is_own ? nullptr : &found->second;
}

/// Numbers of the first and the last value of an axis in `interval`; for a range of values one more
/// at each end. None if no value is in the interval.
std::optional<PointRange> numbers_in(const protocol::Axis& axis, const Interval& interval) {
  if (axis.count() > 0) {
    if (interval.low > interval.high) {
      return std::nullopt;
    }
    const std::uint64_t first = protocol::first_value_from(axis, interval.low);
    const std::uint64_t last = protocol::first_value_from(axis, interval.high) + 1;
    return PointRange{first - std::min<std::uint64_t>(first, 1), std::min(last, axis.count() - 1)};
  }
  std::optional<PointRange> found;
  for (int i = 0; i < axis.values_size(); ++i) {
    if (axis.values(i) >= interval.low && axis.values(i) <= interval.high) {
      const auto number = static_cast<std::uint64_t>(i);
      found = {found ? found->first : number, number};
    }
  }
  return found;
}

/// Ranges of a block's points, numbered from 0. A product is built from its fastest axis outwards.
Ranges ranges_in(const protocol::Block& block, const Intervals& intervals) {
  const std::uint64_t points = protocol::points_of_block(block);
  if (points == 0) {
    return {};
  }
  if (block.has_sample() || block.zip()) {
    return {{0, points - 1}};
  }
  Ranges ranges{{0, 0}};  // of the axes from `a` on
  std::uint64_t stride = 1;
  for (int a = block.axes_size(); a-- > 0;) {
    const protocol::Axis& axis = block.axes(a);
    const std::uint64_t size = protocol::axis_size(axis);
    const Interval* const interval = interval_of(axis, intervals);
    const auto numbers =
        interval == nullptr ? PointRange{0, size - 1} : numbers_in(axis, *interval);
    if (!numbers) {
      return {};
    }
    const PointRange all = hull(ranges).front();
    const bool is_whole = ranges.size() == 1 && all == PointRange{0, stride - 1};
    if (is_whole || numbers->last - numbers->first >= kMostRanges / ranges.size()) {
      ranges = {{numbers->first * stride + all.first, numbers->last * stride + all.last}};
    } else {
      Ranges copies;
      for (std::uint64_t i = numbers->first; i <= numbers->last; ++i) {
        for (const PointRange& range : ranges) {
          copies.push_back({i * stride + range.first, i * stride + range.last});
        }
      }
      ranges = std::move(copies);
    }
    stride *= size;
  }
  return ranges;
}

}  // namespace

std::vector<PointRange> point_ranges(const protocol::Recipe& recipe, std::string_view condition) {
  const auto tokens = sql_tokens(condition);
  Intervals intervals;
  add_conjuncts(tokens, 0, intervals);
  Ranges ranges;
  std::uint64_t points = 0;
  for (const protocol::Block& block : recipe.blocks()) {
    for (const PointRange& range : ranges_in(block, intervals)) {
      if (!ranges.empty() && ranges.back().last + 1 == points + range.first) {
        ranges.back().last = points + range.last;
      } else {
        ranges.push_back({points + range.first, points + range.last});
      }
    }
    if (ranges.size() > kMostRanges) {
      ranges = hull(ranges);
    }
    points += protocol::points_of_block(block);
  }
  return ranges;
}

std::uint64_t points_in(const std::vector<PointRange>& ranges) {
  std::uint64_t points = 0;
  for (const PointRange& range : ranges) {
    points += range.last - range.first + 1;
  }
  return points;
}

}  // namespace oblique::server
