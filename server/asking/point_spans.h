#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/oblique.pb.h"
#include "server/asking/conditions.h"

namespace oblique::server {

/// Points that follow each other, both ends in.
struct PointSpan {
  std::uint64_t first;
  std::uint64_t last;

  bool operator==(const PointSpan&) const = default;
};

/// Most spans that a study is cut into: beyond it neighbours are joined over what is between them.
inline constexpr std::size_t kMostSpans = 20'000;

/// Spans of points, rising and apart, outside which no point of `recipe` lies in any of `boxes`:
/// the values of axes stand in the recipe, so that no row is read for it. Samples, expressions and
/// models of more than one length restrict nothing. Work by the number of listed values, of spans,
/// and the logarithm of what ranges have. Throws nothing for a recipe that was judged.
std::vector<PointSpan> spans_of(const protocol::Recipe& recipe, const Boxes& boxes);

/// A column that rows are sorted by.
struct SortKey {
  std::string column;
  bool falls = false;
};

/// The same points in spans that, read one after another, give them sorted by `keys`, then by their
/// number: for each value of the first key those of each value of the second, and so on. None where
/// that takes more than `kMostSpans`, or where a key is no axis with values of its own in every
/// block.
std::optional<std::vector<PointSpan>> sorted_spans_of(const protocol::Recipe& recipe,
                                                      const Boxes& boxes,
                                                      std::span<const SortKey> keys);

/// Number of points of a recipe, filters left aside; 0 where an axis has no value. Throws
/// solver::InputError for a block of more points than a study may have.
std::uint64_t points_of(const protocol::Recipe& recipe);

/// The same with what filters leave in, where that was counted: the points that a study counts.
std::uint64_t points_left_in(const protocol::Recipe& recipe);

/// Points in all of them.
std::uint64_t points_in(const std::vector<PointSpan>& spans);

}  // namespace oblique::server
