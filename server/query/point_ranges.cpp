#include "server/query/point_ranges.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "proto/recipe/blocks.h"
#include "server/query/columns.h"
#include "server/query/sql_functions.h"
#include "server/query/sql_text.h"

namespace oblique::server {
namespace {

using Ranges = std::vector<PointRange>;
using Tokens = std::span<const SqlToken>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// More ranges are merged into one, because the statement would be long and slow to start.
constexpr std::size_t kMostRanges = 20'000;
/// Finding the first row of a range costs about as much as reading this many rows.
constexpr std::uint64_t kRowsARange = 3;
/// Conditions in more nested brackets than this are ignored.
constexpr int kDeepest = 50;

struct Interval {
  double low = -kInfinity;
  double high = kInfinity;
};
/// The interval of each column that a condition restricts.
using Intervals = std::map<std::string, Interval, std::less<>>;

/// The number in `tokens`, with or without a sign; none if they are not a plain number.
std::optional<double> number_in(Tokens tokens) {
  const bool is_negative = !tokens.empty() && tokens[0].is_sign('-');
  if (is_negative || (!tokens.empty() && tokens[0].is_sign('+'))) {
    tokens = tokens.subspan(1);
  }
  const bool is_literal = tokens.size() == 1 && tokens[0].kind == SqlToken::Kind::kLiteral;
  const auto number = is_literal ? decimal_number(tokens[0].text) : std::nullopt;
  return number && is_negative ? std::optional(-*number) : number;
}

/// A column and the interval to which a condition restricts it.
using Restriction = std::optional<std::pair<std::string, Interval>>;

Restriction restriction(Tokens column, std::optional<double> low, std::optional<double> high) {
  const bool is_column = column.size() == 1 && column[0].kind == SqlToken::Kind::kName;
  return is_column && low && high ? Restriction({std::string(column[0].text), {*low, *high}})
                                  : std::nullopt;
}

/// Reads `column < number`, `number < column` and so on; none for other tokens.
Restriction comparison(Tokens tokens) {
  const auto is_comparing = [](const SqlToken& token) {
    return token.is_sign('<') || token.is_sign('=') || token.is_sign('>');
  };
  const auto sign = std::ranges::find_if(tokens, is_comparing);
  const auto end = std::find_if_not(sign, tokens.end(), is_comparing);
  std::string text;
  std::for_each(sign, end, [&](const SqlToken& token) { text += token.text; });
  Tokens column(tokens.begin(), sign);
  auto number = number_in({end, tokens.end()});
  if (const auto first = number_in(column)) {
    column = {end, tokens.end()};
    number = first;
    std::ranges::transform(text, text.begin(), [](char c) {
      return c == '<' ? '>' : c == '>' ? '<' : c;
    });
  }
  if (text == "=" || text == "==") {
    return restriction(column, number, number);
  }
  if (text == "<" || text == "<=") {
    return restriction(column, -kInfinity, number);
  }
  return text == ">" || text == ">=" ? restriction(column, number, kInfinity) : std::nullopt;
}

/// Reads `column BETWEEN number AND number`; none for other tokens.
Restriction between(Tokens tokens) {
  const Tokens bounds = tokens.subspan(2);
  const auto middle =
      std::ranges::find_if(bounds, [](const SqlToken& token) { return is_word(token, "and"); });
  return middle == bounds.end() ? std::nullopt
                                : restriction(tokens.first(1), number_in({bounds.begin(), middle}),
                                              number_in({middle + 1, bounds.end()}));
}

/// Adds to `all` the conditions that `tokens` join with AND. Adds none if it cannot separate them.
void add_conjuncts(Tokens tokens, int depth, std::vector<Tokens>& all) {
  if (depth > kDeepest || tokens.empty()) {
    return;
  }
  if (tokens[0].is_sign('(') && closing_bracket(tokens, 0) == tokens.size() - 1) {
    add_conjuncts(tokens.subspan(1, tokens.size() - 2), depth + 1, all);
    return;
  }
  std::vector<Tokens> parts;
  std::size_t begin = 0;
  std::size_t open_betweens = 0;
  for (std::size_t i = 0; i <= tokens.size(); ++i) {
    if (i == tokens.size() || (is_word(tokens[i], "and") && open_betweens == 0)) {
      parts.push_back(tokens.subspan(begin, i - begin));
      begin = i + 1;
    } else if (is_word(tokens[i], "or") || is_word(tokens[i], "case")) {
      return;  // not a conjunction
    } else if (tokens[i].is_sign('(')) {
      i = std::min(closing_bracket(tokens, i), tokens.size() - 1);
    } else if (is_word(tokens[i], "between")) {
      ++open_betweens;
    } else if (is_word(tokens[i], "and")) {
      --open_betweens;
    }
  }
  for (const Tokens part : parts) {
    if (parts.size() > 1 && !part.empty() && part[0].is_sign('(')) {
      add_conjuncts(part, depth + 1, all);
    } else {
      all.push_back(part);
    }
  }
}

std::vector<Tokens> conjuncts_of(Tokens tokens) {
  std::vector<Tokens> all;
  add_conjuncts(tokens, 0, all);
  return all;
}

/// The intervals to which a condition restricts columns.
Intervals intervals_of(std::string_view condition) {
  const auto tokens = sql_tokens(condition);
  Intervals intervals;
  for (const Tokens part : conjuncts_of(tokens)) {
    const auto found =
        part.size() > 2 && is_word(part[1], "between") ? between(part) : comparison(part);
    if (found) {
      Interval& known = intervals[found->first];
      known = {std::max(known.low, found->second.low), std::min(known.high, found->second.high)};
    }
  }
  return intervals;
}

/// The interval to which an axis is restricted; nullptr: none, or the column depends on other axes.
const Interval* interval_of(const protocol::Block& block, const protocol::Axis& axis,
                            const Intervals& intervals) {
  // The column `length` is the length of every link, which axes of single lengths change too.
  const bool is_of_many =
      axis.key() == "length" &&
      std::any_of(block.axes().begin(), block.axes().end(), [](const auto& other) {
        return other.key() != "length" && other.key().starts_with("length");
      });
  const auto found = intervals.find(column_of_key(axis.key()));
  return found == intervals.end() || is_of_many || axis.key() == "integrator" ||
                 !protocol::has_own_values(axis)
             ? nullptr
             : &found->second;
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
    const Interval* const interval = interval_of(block, axis, intervals);
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

/// The part of `ranges` whose numbers lie in `interval`.
Ranges clipped(const Ranges& ranges, const Interval& interval) {
  Ranges left;
  for (const PointRange& range : ranges) {
    const double first = std::max(static_cast<double>(range.first), interval.low);
    const double last = std::min(static_cast<double>(range.last), interval.high);
    if (first <= last) {
      left.push_back({static_cast<std::uint64_t>(first), static_cast<std::uint64_t>(last)});
    }
  }
  return left;
}

}  // namespace

std::vector<PointRange> hull(const std::vector<PointRange>& ranges) {
  return {{ranges.front().first, ranges.back().last}};
}

bool wants_only_failed(std::string_view condition) {
  const auto tokens = sql_tokens(condition);
  const auto parts = conjuncts_of(tokens);
  return std::ranges::any_of(parts, [](Tokens part) {
    return part.size() == 4 && is_word(part[0], "error") && is_word(part[1], "is") &&
           is_word(part[2], "not") && is_word(part[3], "null");
  });
}

std::vector<PointRange> point_ranges(const protocol::Recipe& recipe, std::string_view condition) {
  const Intervals intervals = intervals_of(condition);
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
  if (const auto numbers = intervals.find("point"); numbers != intervals.end()) {
    ranges = clipped(ranges, numbers->second);
  }
  const bool are_worth_it = points_in(ranges) + kRowsARange * ranges.size() <= points - points / 10;
  return ranges.size() > 1 && !are_worth_it ? hull(ranges) : ranges;
}

std::uint64_t points_of(const protocol::Recipe& recipe) {
  std::uint64_t points = 0;
  for (const protocol::Block& block : recipe.blocks()) {
    // An axis without values is not valid, and its points cannot be counted.
    if (std::any_of(block.axes().begin(), block.axes().end(),
                    [](const auto& axis) { return protocol::axis_size(axis) == 0; })) {
      return 0;
    }
    points += protocol::points_of_block(block);
  }
  return points;
}

std::uint64_t points_in(const std::vector<PointRange>& ranges) {
  std::uint64_t points = 0;
  for (const PointRange& range : ranges) {
    points += range.last - range.first + 1;
  }
  return points;
}

}  // namespace oblique::server
