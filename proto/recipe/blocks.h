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

/// Returns the number of a key. The model keys come first, in the order of solver::model_keys().
/// Then come `length1`, `length2`, ..., and last H, mu and e. Throws InputError for an unknown key,
/// with the nearest key and a list of all.
std::size_t key_number(std::string_view name);
/// Returns the key called `name`. Throws the errors of `key_number`.
const solver::ParameterKey& axis_key(std::string_view name);
bool is_axis_key(std::string_view name);

const solver::ParameterKey& key_numbered(std::size_t number);

/// Returns whether the key is H, mu or e; false for model keys.
bool is_point_key(std::size_t number);

/// Returns the link, counted from 0, whose length the key sets; nothing for other keys. The keys of
/// single links are applied after `links` and `length`.
std::optional<std::size_t> link_of_key(std::size_t number);

/// Maximum number of points of a study.
inline constexpr std::uint64_t kMaxPoints = 1'000'000'000'000;

/// Every block ends with the axes of these keys, in this order.
inline constexpr std::array<std::string_view, 3> kPointKeyOrder{"H", "mu", "e"};

/// Returns the number of values of an axis: the length of its list or range, or 1 for a
/// distribution or an expression.
std::uint64_t axis_size(const Axis& axis);

/// Returns whether the axis is a list or a range.
bool has_own_values(const Axis& axis);

/// Returns value i of a list or range. Throws std::out_of_range if the axis has no such value.
double axis_value(const Axis& axis, std::uint64_t i);

/// Computes the values of a range (README.md). Both ends are exact.
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
  /// Value i of a range of decimals is (first + step i) / per_unit, with whole numbers below 2^53.
  struct Decimals {
    double first;
    double step;
    double per_unit;  ///< a power of ten
  };
  std::optional<Decimals> decimals_;
};

/// Return the smallest and largest value of a list or range, or the ends of a distribution, which
/// may be infinite.
double smallest_value(const Axis& axis);
double largest_value(const Axis& axis);

/// The ways in which the axes of a block make points.
enum class BlockKind : std::uint8_t {
  kProduct,  ///< all combinations of the values; the first axis varies slowest
  kZip,      ///< point i has value i of each axis; an axis with one value is constant
  kSample,   ///< drawn from the axes' distributions, or with equal probability from their values
};
BlockKind block_kind(const Block& block);

/// Return the axes of a checked block: all except H, mu and e, or only these three.
std::span<const Axis* const> model_axes(const Block& block);
std::span<const Axis* const> point_axes(const Block& block);

/// Returns whether values of an axis are drawn: it has a distribution or several values.
bool is_drawn(const Axis& axis);

/// Returns the number of points of a checked block, including points that its filter leaves out.
/// Throws solver::InputError if it exceeds `kMaxPoints`.
std::uint64_t points_of_block(const Block& block);

/// Throws solver::InputError if `points` exceeds `kMaxPoints`.
void check_point_count(std::uint64_t points);

/// The position of an axis in its block. In a product or zip, point p of the block has value number
/// p / stride % values of the axis.
struct AxisLayout {
  const Axis* axis;
  std::size_t key;       ///< `key_number` of its key
  std::uint64_t values;  ///< number of values; 1 for an expression, 0 if values are drawn
  std::uint64_t stride;
};

/// Returns the axes of a checked block, in order.
std::vector<AxisLayout> layout_of(const Block& block);

/// Returns the model of the shortest finger in the block. Ignores axes that are expressions.
solver::ModelParameters shortest_model(solver::ModelParameters model, const Block& block);

/// Returns the model axes of a checked block that change the fall.
std::vector<const Axis*> fall_axes(solver::ModelParameters model, const Block& block);

/// The tip of any finger can drop by this fraction of the finger's length. H must not exceed the
/// length. Between these two limits only a computed fall shows whether the tip reaches H.
inline constexpr double kSurelyReached = 0.9;

// Rules for studies. Parsers of files and flags apply them, and the server applies them again.
// Every InputError names the key.

/// Throws InputError unless both ends of a range are allowed and from <= to.
void check_ends(const solver::ParameterKey& key, double from, double to);

/// Throws InputError, which names key, value and what is allowed, unless the block is valid. Each
/// axis must be a list, a rising range, an expression or, in a sample, a distribution; its values
/// must be finite and in the key's domain. Each key must occur once, in the right order, and fit
/// the kind of block. H must not exceed the length of the block's shortest finger; if this depends
/// on the point it is not checked (`needs_point_validation`).
void check_block(const solver::ModelParameters& model, const Block& block);

/// Returns whether a block has an expression, a filter, or an H above the length of a finger.
bool needs_point_validation(const solver::ModelParameters& model, const Block& block);

/// Makes a block from axes with known keys. Sorts the axes by `key_number`; does not check them.
Block block_of(std::vector<Axis> axes);

}  // namespace oblique::protocol
