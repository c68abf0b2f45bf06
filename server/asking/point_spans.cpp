#include "server/asking/point_spans.h"

#include <algorithm>
#include <optional>
#include <span>
#include <string>

#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "server/asking/columns.h"

namespace oblique::server {
namespace {

using Spans = std::vector<PointSpan>;

/// Reading so many rows in between costs less than looking for the next one.
constexpr std::uint64_t kReadOver = 2;
/// Values of axes side by side are looked at one by one, up to so many.
constexpr std::uint64_t kMostLookedAt = 2'000'000;

/// How spans are made. Those that are read in the order of something else than points hold no point
/// that was not asked for.
struct Cut {
  bool is_exact = false;
  bool has_too_many = false;  ///< an exact cut would take too many spans
  std::uint64_t read_over() const { return is_exact ? 0 : kReadOver; }
};

/// Joins what overlaps, and what at most `between` numbers are between. `spans` must rise.
Spans joined(const Spans& spans, std::uint64_t between) {
  Spans whole;
  for (const PointSpan& span : spans) {
    if (!whole.empty() && span.first <= whole.back().last + 1 + between) {
      whole.back().last = std::max(whole.back().last, span.last);
    } else {
      whole.push_back(span);
    }
  }
  return whole;
}

Spans in_order(Spans spans, std::uint64_t between) {
  std::sort(spans.begin(), spans.end(),
            [](const PointSpan& a, const PointSpan& b) { return a.first < b.first; });
  return joined(spans, between);
}

/// Joins neighbours until `most` are left, the nearest to each other first.
Spans coarsened(Spans spans, std::size_t most) {
  if (spans.size() <= most) {
    return spans;
  }
  std::vector<std::uint64_t> gaps;
  for (std::size_t i = 1; i < spans.size(); ++i) {
    gaps.push_back(spans[i].first - spans[i - 1].last - 1);
  }
  const std::size_t joins = spans.size() - most;
  auto sorted = gaps;
  const auto widest = sorted.begin() + static_cast<std::ptrdiff_t>(joins) - 1;
  std::nth_element(sorted.begin(), widest, sorted.end());
  // Many gaps may be as wide as the widest that is joined: of these so many are.
  auto as_wide = static_cast<std::ptrdiff_t>(joins) -
                 std::count_if(sorted.begin(), widest, [&](auto gap) { return gap < *widest; });
  Spans whole{spans.front()};
  for (std::size_t i = 1; i < spans.size(); ++i) {
    const std::uint64_t gap = gaps[i - 1];
    if (gap < *widest || (gap == *widest && as_wide-- > 0)) {
      whole.back().last = spans[i].last;
    } else {
      whole.push_back(spans[i]);
    }
  }
  return whole;
}

/// The values of an axis that has its own, for many looks.
class AxisValues {
 public:
  explicit AxisValues(const protocol::Axis& axis) : axis_(axis) {
    if (axis.count() > 0) {
      range_.emplace(axis);
    }
  }
  /// Value `i`; the last one for numbers beyond.
  double at(std::uint64_t i) const {
    const std::uint64_t number = std::min(i, protocol::axis_size(axis_) - 1);
    return range_ ? range_->at(number) : axis_.values(static_cast<int>(number));
  }

 private:
  const protocol::Axis& axis_;
  std::optional<protocol::RangeValues> range_;
};

/// The first number below `size` for which `is_behind` is true, which stays true from there on.
template <class IsBehind>
std::uint64_t first_behind(std::uint64_t size, const IsBehind& is_behind) {
  std::uint64_t low = 0;
  std::uint64_t high = size;
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    if (is_behind(middle)) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

/// Numbers of the values of an axis that rise, in any of `values`.
Spans numbers_in_range(const protocol::Axis& axis, const ValueSet& values) {
  const protocol::RangeValues range_values(axis);
  Spans numbers;
  for (const ValueRange& range : values.ranges()) {
    const std::uint64_t begin = first_behind(axis.count(), [&](std::uint64_t i) {
      const double value = range_values.at(i);
      return range.low_is_open ? value > range.low : value >= range.low;
    });
    const std::uint64_t end = first_behind(axis.count(), [&](std::uint64_t i) {
      const double value = range_values.at(i);
      return range.high_is_open ? value >= range.high : value > range.high;
    });
    if (begin < end) {
      numbers.push_back({begin, end - 1});
    }
  }
  return in_order(std::move(numbers), 0);
}

Spans numbers_in(const protocol::Axis& axis, const ValueSet& values) {
  if (axis.count() > 0) {
    return numbers_in_range(axis, values);
  }
  Spans numbers;
  for (int i = 0; i < axis.values_size(); ++i) {
    if (values.contains(axis.values(i))) {
      numbers.push_back({static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(i)});
    }
  }
  return joined(numbers, 0);
}

/// What `box` wants of an axis; nullptr: nothing that the axis alone decides.
const ValueSet* wanted(const protocol::Block& block, const protocol::Axis& axis, const Box& box) {
  const auto found = box.find(column_of_key(axis.key()));
  // The column `length` is that of every link, and single lengths are axes too.
  const bool is_of_many = axis.key() == "length" &&
                          std::any_of(block.axes().begin(), block.axes().end(), [](const auto& a) {
                            return a.key() != "length" && a.key().starts_with("length");
                          });
  return found == box.end() || is_of_many || !protocol::has_own_values(axis) ? nullptr
                                                                             : &found->second;
}

/// Points of a product of axes, numbered from 0. Built from the fastest axis outwards.
Spans in_product(const protocol::Block& block, const Box& box, Cut& cut) {
  Spans spans{{0, 0}};
  std::uint64_t stride = 1;
  for (int a = block.axes_size(); a-- > 0;) {
    const protocol::Axis& axis = block.axes(a);
    const std::uint64_t size = protocol::axis_size(axis);
    const ValueSet* const values = wanted(block, axis, box);
    const Spans numbers = values == nullptr ? Spans{{0, size - 1}} : numbers_in(axis, *values);
    if (numbers.empty()) {
      return {};
    }
    const std::uint64_t count = points_in(numbers);
    const bool is_whole = spans.size() == 1 && spans[0] == PointSpan{0, stride - 1};
    // Where there would be too many, each value of this axis is one span, or each run of values.
    if (!is_whole && count > kMostSpans / spans.size()) {
      if (cut.is_exact) {
        cut.has_too_many = true;
        return {};
      }
      spans = {{spans.front().first, spans.back().last}};
    }
    Spans wider;
    for (const PointSpan& run : numbers) {
      if (is_whole || (spans.size() == 1 && count > kMostSpans)) {
        wider.push_back({run.first * stride + spans[0].first, run.last * stride + spans[0].last});
        continue;
      }
      for (std::uint64_t i = run.first; i <= run.last; ++i) {
        for (const PointSpan& span : spans) {
          wider.push_back({i * stride + span.first, i * stride + span.last});
        }
      }
    }
    spans = joined(wider, cut.read_over());
    stride *= size;
  }
  return spans;
}

/// Points of axes side by side; those with one value have it in every point.
Spans in_zip(const protocol::Block& block, const Box& box, Cut& cut) {
  const std::uint64_t size = protocol::points_of_block(block);
  if (size > kMostLookedAt) {
    cut.has_too_many = true;
    return {{0, size - 1}};
  }
  std::vector<bool> is_in(size, true);
  for (const protocol::Axis& axis : block.axes()) {
    const ValueSet* const values = wanted(block, axis, box);
    if (values == nullptr) {
      continue;
    }
    const AxisValues own(axis);
    for (std::uint64_t i = 0; i < size; ++i) {
      is_in[i] = is_in[i] && values->contains(own.at(i));
    }
  }
  Spans spans;
  for (std::uint64_t i = 0; i < size; ++i) {
    if (is_in[i]) {
      spans.push_back({i, i});
    }
  }
  return joined(spans, cut.read_over());
}

Spans in_block(const protocol::Block& block, const Box& box, Cut& cut) {
  if (block.has_sample()) {
    const std::uint64_t size = protocol::points_of_block(block);
    return size == 0 ? Spans() : Spans{{0, size - 1}};
  }
  return block.zip() ? in_zip(block, box, cut) : in_product(block, box, cut);
}

/// What of `spans` has a number that the box wants.
Spans with_wanted_numbers(const Spans& spans, const Box& box) {
  const auto wanted_points = box.find("point");
  if (wanted_points == box.end()) {
    return spans;
  }
  Spans left;
  for (const ValueRange& range : wanted_points->second.ranges()) {
    for (const PointSpan& span : spans) {
      if (static_cast<double>(span.last) >= range.low &&
          static_cast<double>(span.first) <= range.high) {
        const double first = std::max(static_cast<double>(span.first), range.low);
        const double last = std::min(static_cast<double>(span.last), range.high);
        if (first <= last) {
          left.push_back({static_cast<std::uint64_t>(first), static_cast<std::uint64_t>(last)});
        }
      }
    }
  }
  return left;
}

Spans cut_by(const protocol::Recipe& recipe, const Boxes& boxes, Cut& cut) {
  Spans all;
  for (const Box& box : boxes) {
    std::uint64_t first = 0;
    Spans of_box;
    for (const protocol::Block& block : recipe.blocks()) {
      for (const PointSpan& span : in_block(block, box, cut)) {
        of_box.push_back({first + span.first, first + span.last});
      }
      first += protocol::points_of_block(block);
    }
    const Spans kept = with_wanted_numbers(coarsened(joined(of_box, 0), kMostSpans), box);
    cut.has_too_many = cut.has_too_many || of_box.size() > kMostSpans;
    all.insert(all.end(), kept.begin(), kept.end());
  }
  return in_order(std::move(all), cut.read_over());
}

/// The values of an axis in all blocks, each once; none where a block has no such axis, or there
/// are too many.
std::optional<std::vector<double>> values_of(const protocol::Recipe& recipe,
                                             const std::string& column) {
  const Box anything{{column, ValueSet::all()}};
  std::vector<double> values;
  for (const protocol::Block& block : recipe.blocks()) {
    const auto axis = std::find_if(
        block.axes().begin(), block.axes().end(),
        [&](const protocol::Axis& known) { return wanted(block, known, anything) != nullptr; });
    if (block.has_sample() || axis == block.axes().end() ||
        values.size() + protocol::axis_size(*axis) > kMostSpans) {
      return std::nullopt;
    }
    const AxisValues own(*axis);
    for (std::uint64_t i = 0; i < protocol::axis_size(*axis); ++i) {
      values.push_back(own.at(i));
    }
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

/// No recipe that was judged has one, and none can be counted with it.
bool has_empty_axis(const protocol::Block& block) {
  return std::any_of(block.axes().begin(), block.axes().end(),
                     [](const protocol::Axis& axis) { return protocol::axis_size(axis) == 0; });
}

/// Appends to `sorted` what `boxes` hold, sorted by `keys`. False: it takes too many spans.
bool add_sorted(const protocol::Recipe& recipe, const Boxes& boxes, std::span<const SortKey> keys,
                Spans& sorted) {
  if (keys.empty()) {
    Cut cut{.is_exact = true};
    const Spans spans = cut_by(recipe, boxes, cut);
    sorted.insert(sorted.end(), spans.begin(), spans.end());
    return !cut.has_too_many && sorted.size() <= kMostSpans;
  }
  auto values = values_of(recipe, keys.front().column);
  if (!values) {
    return false;
  }
  if (keys.front().falls) {
    std::reverse(values->begin(), values->end());
  }
  return std::all_of(values->begin(), values->end(), [&](double value) {
    Boxes narrowed = boxes;
    for (Box& box : narrowed) {
      box.try_emplace(keys.front().column, ValueSet::all())
          .first->second.intersect(ValueSet({value, value}));
    }
    return add_sorted(recipe, narrowed, keys.subspan(1), sorted);
  });
}

}  // namespace

std::vector<PointSpan> spans_of(const protocol::Recipe& recipe, const Boxes& boxes) {
  Cut cut;
  return coarsened(cut_by(recipe, boxes, cut), kMostSpans);
}

std::optional<std::vector<PointSpan>> sorted_spans_of(const protocol::Recipe& recipe,
                                                      const Boxes& boxes,
                                                      std::span<const SortKey> keys) {
  // Each combination of values walks the axes once.
  std::uint64_t walks = 1;
  std::uint64_t listed = 1;
  for (const SortKey& key : keys) {
    const auto values = values_of(recipe, key.column);
    walks *= values ? std::max<std::uint64_t>(values->size(), 1) : kMostSpans + 1;
    if (walks > kMostSpans) {
      return std::nullopt;
    }
  }
  for (const protocol::Block& block : recipe.blocks()) {
    for (const protocol::Axis& axis : block.axes()) {
      listed += static_cast<std::uint64_t>(axis.values_size()) + 1;
    }
    listed += block.zip() ? protocol::points_of_block(block) : 0;
  }
  Spans sorted;
  if (listed > kMostLookedAt / walks / boxes.size() || !add_sorted(recipe, boxes, keys, sorted)) {
    return std::nullopt;
  }
  return sorted;
}

std::uint64_t points_of(const protocol::Recipe& recipe) {
  std::uint64_t points = 0;
  for (const protocol::Block& block : recipe.blocks()) {
    if (has_empty_axis(block)) {
      return 0;
    }
    points += protocol::points_of_block(block);
  }
  return points;
}

std::uint64_t points_left_in(const protocol::Recipe& recipe) {
  std::uint64_t points = points_of(recipe);
  for (const protocol::Block& block : recipe.blocks()) {
    if (points > 0 && !block.where().empty() && block.has_points_left_in()) {
      const std::uint64_t all = protocol::points_of_block(block);
      points -= all - std::min(all, block.points_left_in());
    }
  }
  return points;
}

std::uint64_t points_in(const std::vector<PointSpan>& spans) {
  std::uint64_t points = 0;
  for (const PointSpan& span : spans) {
    points += span.last - span.first + 1;
  }
  return points;
}

}  // namespace oblique::server
