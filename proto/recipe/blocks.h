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

/// The axes of a block that was judged: those of the model, and then H, mu and e.
std::span<const Axis* const> model_axes(const Block& block);
std::span<const Axis* const> point_axes(const Block& block);

/// Whether an axis of a sample is drawn: from a distribution, or from several values.
bool is_drawn(const Axis& axis);

/// Number of points of a block that was judged, with those that its filter leaves out. Throws
/// solver::InputError above `kMaxPoints`.
std::uint64_t points_of_block(const Block& block);

/// Number of points, or models, that axes make when they multiply; none of them is empty. Throws
/// solver::InputError above `kMaxPoints`.
std::uint64_t combinations(std::span<const Axis* const> axes);

/// Product of two such numbers, none of them 0. Throws solver::InputError above `kMaxPoints`.
std::uint64_t checked_product(std::uint64_t a, std::uint64_t b);
[[noreturn]] void throw_too_many_points();

/// One axis among the others of its block. Point p of a product or zip, counted in the block, has
/// value number p / stride % values of the axis.
struct AxisLayout {
  const Axis* axis;
  std::size_t key;       ///< `key_number` of its key
  std::uint64_t values;  ///< 1 of an axis whose value follows by an expression; 0: it is drawn
  std::uint64_t stride;
};

/// The axes of a block that was judged, in their order.
std::vector<AxisLayout> layout_of(const Block& block);

/// Whether the block is a product of lists and ranges, without expressions and without a filter, so
/// that conditions on its axes are sets of points by `layout_of` alone.
bool is_plain_product(const Block& block);

/// The model of the shortest finger that lists, ranges and distributions of the block make of
/// `model`: length grows with every key that sets it.
solver::ModelParameters shortest_model(solver::ModelParameters model, const Block& block);

/// No finger turns back before its tip has dropped by this part of its length. From there up to the
/// length, which is what the rules of a block allow, only the fall tells.
inline constexpr double kSurelyReached = 0.9;

/// That drop in m of the shortest finger of a block that was judged, where the block has H above it
/// or may have (H follows by an expression); nothing where the tip surely reaches every H.
std::optional<double> surely_reached_m(const solver::ModelParameters& model, const Block& block);

/// A block of the axes, in the order that recipes need: model keys as listings have them, then H,
/// mu and e. Judges nothing. Keys must be known.
Block block_of(std::vector<Axis> axes);

}  // namespace oblique::protocol
