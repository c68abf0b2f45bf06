#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// Maximum number of links of a model.
inline constexpr std::size_t kMaxLinks = 64;

/// Number of a key: first the keys of a model in the order of listings, then `length1`, `length2`,
/// ..., then H, mu and e. Throws InputError for an unknown key, with the nearest one and a list of
/// all.
std::size_t key_number(std::string_view name);
/// The key called `name`; throws as `key_number` does.
const solver::ParameterKey& axis_key(std::string_view name);
bool is_axis_key(std::string_view name);

const solver::ParameterKey& key_numbered(std::size_t number);

/// Whether the key is H, mu or e; false for model keys.
bool is_point_key(std::size_t number);

/// The link, from 0, whose length the key sets; none for other keys. These keys are applied after
/// `links` and `length`.
std::optional<std::size_t> link_of_key(std::size_t number);

/// Maximum number of points of a study.
inline constexpr std::uint64_t kMaxPoints = 1'000'000'000'000;

/// Every block ends with the point keys in this order.
inline constexpr std::array<std::string_view, 3> kPointKeyOrder{"H", "mu", "e"};

/// Number of values of an axis: the length of a list or range, and 1 for an axis with a
/// distribution or an expression.
std::uint64_t axis_size(const Axis& axis);

/// Whether the axis is a list or a range.
bool has_own_values(const Axis& axis);

/// Value i of a list or range. Throws std::out_of_range if the axis has no such value.
double axis_value(const Axis& axis, std::uint64_t i);

/// The values of a range (README.md). Both ends are exact.
class RangeValues {
 public:
  /// `axis` must have a count.
  explicit RangeValues(const Axis& axis);
  double at(std::uint64_t i) const;

 private:
  double from_;
  double to_;
  std::uint64_t last_;
  bool is_logarithmic_;
  /// Value i is (first + step i) / per_unit, in whole numbers below 2^53.
  struct Decimals {
    double first;
    double step;
    double per_unit;  ///< a power of ten
  };
  std::optional<Decimals> decimals_;
};

/// Smallest and largest value of a list or range, or the ends of a distribution, which may be
/// infinite.
double smallest_value(const Axis& axis);
double largest_value(const Axis& axis);

/// How the axes of a block make points.
enum class BlockKind : std::uint8_t {
  kProduct,  ///< all combinations of the values; the first axis varies slowest
  kZip,      ///< point i has value i of each axis; an axis of one value is constant
  kSample,   ///< drawn from distributions, or with equal probability from the values of an axis
};
BlockKind block_kind(const Block& block);

/// The axes of a checked block: all except H, mu and e, and these three.
std::span<const Axis* const> model_axes(const Block& block);
std::span<const Axis* const> point_axes(const Block& block);

/// Whether an axis of a sample is drawn: it has a distribution or several values.
bool is_drawn(const Axis& axis);

/// Number of points of a checked block, including those that its filter leaves out. Throws
/// solver::InputError above `kMaxPoints`.
std::uint64_t points_of_block(const Block& block);

/// Throws solver::InputError above `kMaxPoints`.
void check_point_count(std::uint64_t points);

/// The position of an axis in its block. In a product or zip, point p of the block has value number
/// p / stride % values of the axis.
struct AxisLayout {
  const Axis* axis;
  std::size_t key;       ///< `key_number` of its key
  std::uint64_t values;  ///< number of values; 1 for an expression, 0 if drawn
  std::uint64_t stride;
};

/// The axes of a checked block, in their order.
std::vector<AxisLayout> layout_of(const Block& block);

/// The model of the shortest finger in the block, ignoring expressions.
solver::ModelParameters shortest_model(solver::ModelParameters model, const Block& block);

/// The tip of every finger can drop by at least this fraction of the finger's length. H must not
/// exceed the length; between the two only a computed fall shows whether the tip reaches H.
inline constexpr double kSurelyReached = 0.9;

// Rules for studies. Parsers of files and flags check them, and the server checks them again. Every
// InputError has the key.

/// Throws InputError unless the ends of a range are allowed and from <= to.
void check_ends(const solver::ParameterKey& key, double from, double to);

/// Throws InputError, which names key, value and what is allowed, unless the block is valid. Each
/// axis must be a list, a rising range, an expression or, in a sample, a distribution, with finite
/// values in the key's domain. Each key occurs once and in order, and fits the kind of block. H
/// must not exceed the length of the shortest finger of the block; where this depends on the point
/// it is not checked (`needs_point_validation`).
void check_block(const solver::ModelParameters& model, const Block& block);

/// Whether some values, or H against the finger's length, can only be checked point by point.
bool needs_point_validation(const solver::ModelParameters& model, const Block& block);

/// Makes a block of axes with known keys, sorted in the order of recipes: model keys as in
/// listings, H, mu and e. Does not check them.
Block block_of(std::vector<Axis> axes);

}  // namespace oblique::protocol
