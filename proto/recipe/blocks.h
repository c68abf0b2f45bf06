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

/// Most links of a model.
inline constexpr std::size_t kMostLinks = 64;

/// The number of a key: those of a model in the order of listings, then the single lengths
/// `length1`, `length2`, ..., then H, mu and e. Throws InputError for an unknown key, with the
/// nearest and the list of all.
std::size_t key_number(std::string_view name);
/// The key called `name`; throws as `key_number` does.
const solver::ParameterKey& axis_key(std::string_view name);
bool is_axis_key(std::string_view name);

const solver::ParameterKey& key_numbered(std::size_t number);

/// Whether the key is H, mu or e, and not one of the model.
bool is_point_key(std::size_t number);

/// The link, from 0, of a single length. Single lengths act on what `links` and `length` have made.
std::optional<std::size_t> link_of_key(std::size_t number);

/// Most points a study may have.
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

/// Bounds of the values of a list, range or distribution; those of a distribution may be infinite.
double smallest_value(const Axis& axis);
double largest_value(const Axis& axis);

/// How the axes of a block make points.
enum class BlockKind : std::uint8_t {
  kProduct,  ///< all combinations of the values; the first axis varies slowest
  kZip,      ///< point i has value i of each axis; an axis of one value is constant
  kSample,   ///< drawn from distributions, or with equal probability from the values of an axis
};
BlockKind block_kind(const Block& block);

/// The axes of a checked block: those of the model, and then H, mu and e.
std::span<const Axis* const> model_axes(const Block& block);
std::span<const Axis* const> point_axes(const Block& block);

/// Whether an axis of a sample is drawn: from a distribution, or from several values.
bool is_drawn(const Axis& axis);

/// Number of points of a checked block, including those that its filter leaves out. Throws
/// solver::InputError above `kMaxPoints`.
std::uint64_t points_of_block(const Block& block);

/// Throws solver::InputError above `kMaxPoints`.
void check_points(std::uint64_t points);

/// The place of an axis in its block. Point p of the block, a product or zip, has value number p /
/// stride % values of the axis.
struct AxisLayout {
  const Axis* axis;
  std::size_t key;       ///< `key_number` of its key
  std::uint64_t values;  ///< number of values; expression: 1, drawn: 0
  std::uint64_t stride;
};

/// The axes of a checked block, in their order.
std::vector<AxisLayout> layout_of(const Block& block);

/// The model of the shortest finger in the block, without expressions.
solver::ModelParameters shortest_model(solver::ModelParameters model, const Block& block);

/// The tip of every finger drops by at least this part of the finger's length. Between this part
/// and the whole length, the limit for H, only a computed fall shows whether the tip gets there.
inline constexpr double kSurelyReached = 0.9;

// The rules for studies. Parsers of files and flags call these functions, and the server calls them
// again for a received study. Every InputError has the key.

/// Throws InputError unless the ends of a range are allowed and rise.
void check_ends(const solver::ParameterKey& key, double from, double to);

/// Throws InputError, which names key, value and what is allowed, unless each axis of a block is a
/// list, a rising range, an expression or, in a sample, a distribution, and each value is finite
/// and in the key's domain; unless the axes are in order, each once, and fit the kind of the block,
/// and no H is larger than the length of the shortest finger of the block. H is not compared with
/// the length in blocks where this depends on the point (`needs_point_validation`).
void check_block(const solver::ModelParameters& model, const Block& block);

/// Whether some values, or whether H is within the finger's length, can be checked only point by
/// point.
bool needs_point_validation(const solver::ModelParameters& model, const Block& block);

/// A block of the axes, sorted in the order of recipes: model keys as in listings, then H, mu and
/// e. Does not check them. Keys must be known.
Block block_of(std::vector<Axis> axes);

}  // namespace oblique::protocol
