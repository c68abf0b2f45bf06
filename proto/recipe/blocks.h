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

/// The point keys close every block in this order.
inline constexpr std::array<std::string_view, 3> kPointKeyOrder{"H", "mu", "e"};

/// How the axes of a block make points.
enum class BlockKind : std::uint8_t {
  kProduct,  ///< they multiply, the first slowest
  kZip,      ///< side by side: point i has value i of each; an axis of one value has it everywhere
  kSample,   ///< drawn, from distributions or from the values of an axis with equal chances
};
BlockKind block_kind(const Block& block);

/// The axes of a checked block: those of the model, and then H, mu and e.
std::span<const Axis* const> model_axes(const Block& block);
std::span<const Axis* const> point_axes(const Block& block);

/// Whether an axis of a sample is drawn: from a distribution, or from several values.
bool is_drawn(const Axis& axis);

/// Number of points of a checked block, with those that its filter leaves out. Throws
/// solver::InputError above `kMaxPoints`.
std::uint64_t points_of_block(const Block& block);

/// Number of combinations of the values of axes, none of which is empty. Throws solver::InputError
/// above `kMaxPoints`.
std::uint64_t combinations(std::span<const Axis* const> axes);

[[noreturn]] void throw_too_many_points();

/// One axis among the others of its block. Point p of a product or zip, counted in the block, has
/// value number p / stride % values of the axis.
struct AxisLayout {
  const Axis* axis;
  std::size_t key;       ///< `key_number` of its key
  std::uint64_t values;  ///< 1 of an axis whose value follows by an expression; 0: it is drawn
  std::uint64_t stride;
};

/// The axes of a checked block, in their order.
std::vector<AxisLayout> layout_of(const Block& block);

/// Whether the block is a product of lists and ranges without a filter, so that `layout_of` alone
/// gives the points that meet a condition on its axes.
bool is_plain_product(const Block& block);

/// The model of the shortest finger in the block, expressions left out: length grows with every key
/// that sets it.
solver::ModelParameters shortest_model(solver::ModelParameters model, const Block& block);

/// Every finger's tip drops by at least this part of its length. From there up to the length, which
/// the rules of a block allow, only the fall tells.
inline constexpr double kSurelyReached = 0.9;

/// Largest drop [m] that every finger of the block is certain to reach; empty if no H exceeds it.
std::optional<double> surely_reached_m(const solver::ModelParameters& model, const Block& block);

/// A block of the axes in the order of recipes: model keys as in listings, then H, mu and e. Checks
/// nothing. Keys must be known.
Block block_of(std::vector<Axis> axes);

}  // namespace oblique::protocol
