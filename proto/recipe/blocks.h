#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::protocol {

/// Most points a study may have.
inline constexpr std::uint64_t kMaxPoints = 1'000'000'000'000;

/// The point keys close every block in this order.
inline constexpr std::array<std::string_view, 3> kPointKeyOrder{"H", "mu", "e"};

/// The axes of a block that was judged: those of the model, and then H, mu and e.
std::span<const Axis* const> model_axes(const Block& block);
std::span<const Axis* const> point_axes(const Block& block);

/// Number of points, or models, that axes make together; none of them is empty. Throws
/// solver::InputError above `kMaxPoints`.
std::uint64_t combinations(std::span<const Axis* const> axes);

/// Product of two such numbers, none of them 0. Throws solver::InputError above `kMaxPoints`.
std::uint64_t checked_product(std::uint64_t a, std::uint64_t b);
[[noreturn]] void throw_too_many_points();

/// A block of the axes, in the order that recipes need: model keys as listings have them, then H,
/// mu and e. Judges nothing. Keys must be known.
Block block_of(std::vector<Axis> axes);

}  // namespace oblique::protocol
