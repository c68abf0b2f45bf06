#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// Most points a study may have.
inline constexpr std::uint64_t kMaxPoints = 1'000'000'000'000;

/// Every block ends with the point keys in this order.
inline constexpr std::array<std::string_view, 3> kPointKeyOrder{"H", "mu", "e"};

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

/// Number of combinations of the values of axes; each axis has at least one. Throws
/// solver::InputError above `kMaxPoints`.
std::uint64_t combinations(std::span<const Axis* const> axes);

[[noreturn]] void throw_too_many_points();

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

/// Whether the block is a product of lists and ranges without a filter, so that `layout_of` alone
/// gives the points that meet a condition on its axes.
bool is_plain_product(const Block& block);

/// The model of the shortest finger in the block, without expressions: it has the smallest value of
/// each key that sets lengths, because the length grows with each of them.
solver::ModelParameters shortest_model(solver::ModelParameters model, const Block& block);

/// The tip of every finger can drop by at least this part of the finger's length. For drops between
/// this part and the whole length, which is the limit for H, only the computed fall shows whether
/// the tip gets there.
inline constexpr double kSurelyReached = 0.9;

/// The drop [m] that the tip of every finger of the block reaches; empty if no H is larger.
std::optional<double> surely_reached_m(const solver::ModelParameters& model, const Block& block);

/// A block of the axes, sorted in the order of recipes: model keys as in listings, then H, mu and
/// e. Does not check them. Keys must be known.
Block block_of(std::vector<Axis> axes);

}  // namespace oblique::protocol
