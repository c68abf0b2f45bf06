#pragma once

#include <string>
#include <vector>

namespace oblique::client::plot {

/// Where values are on an axis, or in a range of colours: from 0 at `from` to 1 at `to`.
class Scale {
 public:
  /// Ends that are equal, or turned round, or no numbers become a range around them. A logarithmic
  /// scale has positive ends only; throws std::invalid_argument for others.
  Scale(double from, double to, bool is_logarithmic = false);

  double from() const { return from_; }
  double to() const { return to_; }
  bool is_logarithmic() const { return is_logarithmic_; }

  /// Below 0 and above 1 outside the range; NaN for what has no place, as 0 on a logarithmic scale.
  double share_of(double value) const;
  /// The value at a share, for places between the ticks.
  double value_at(double share) const;

 private:
  double from_;
  double to_;
  bool is_logarithmic_;
  double start_;   // from, or its logarithm
  double length_;  // of the range, likewise
};

/// A range of numbers.
struct Range {
  double from;
  double to;

  bool operator==(const Range&) const = default;
};

/// The smallest range that has all numbers but NaN and infinities, and only positive ones if asked
/// for; none: {0, 1}, respectively {0.1, 1}.
Range range_of(const std::vector<double>& values, bool positive_only = false);

/// The union of two.
Range united(const Range& one, const Range& other);

/// A little wider at both ends, so that what lies there is not on the frame; of a logarithmic axis
/// by ratios. A range that does not reach 0 does not cross it.
Range widened(const Range& range, double by_share, bool is_logarithmic = false);

/// A place of an axis that is marked, with its number.
struct Tick {
  double value;
  double share;
  std::string label;  ///< empty: a small mark without one
};

/// The marks of one axis.
struct Ticks {
  std::vector<Tick> ticks;
  int exponent = 0;  ///< labels stand for so many powers of ten; a multiple of 3

  /// " x 10^3" with its digits raised, or nothing: for the label of the axis.
  std::string factor() const;
};

/// About `wanted` round values, 1, 2 or 5 times a power of ten apart, within the range. Of a
/// logarithmic scale powers of ten, with 2 and 5, or 2 to 9, where those are few, and small marks
/// between; where it spans less than a decade and these are fewer than three, as of a linear one.
Ticks ticks_of(const Scale& scale, int wanted);

}  // namespace oblique::client::plot
