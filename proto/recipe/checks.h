#pragma once

#include <cstddef>
#include <string_view>

#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "worker/solver/model/parameters.h"

// What a study may be. These are the only rules: who writes a study puts the place before their
// message, who receives one asks them again.
namespace oblique::protocol {

/// A block lacks H, mu or e. The message begins with the key.
class MissingKey : public solver::InputError {
 public:
  using solver::InputError::InputError;
};

/// Throws InputError naming key, value and what is allowed unless each value is finite and in the
/// key's domain, and they are a list, a range that rises, or what such a block takes besides: in a
/// product a list has no value twice, a sample draws from distributions. Of an expression only the
/// text is judged. Costs a look at each listed value, and at three of a range.
void check_axis(const Axis& axis, BlockKind kind = BlockKind::kProduct);

/// The same for the two ends of a range whose count is not known yet.
void check_ends(const solver::ParameterKey& key, double from, double to);

/// Throws InputError unless the axes of a block are allowed, each once, in order, with H, mu and e
/// (else MissingKey), fit together as the kind of the block wants, and no H is longer than the
/// shortest chain that the block makes of `model`. Of blocks of which that depends on the point
/// (`is_judged_by_points`) not the last.
void check_block(const solver::ModelParameters& model, const Block& block);

/// Whether some of the values, or whether H is in reach, can be judged only point by point.
bool is_judged_by_points(const solver::ModelParameters& model, const Block& block);

/// Most expressions, filters among them, that a study may have.
inline constexpr std::size_t kMostExpressions = 1000;

/// Throws InputError for a recipe that is too long to be sent to a worker in one frame.
void check_size(const Recipe& recipe);

/// Parses the recipe that a database file has, within the limits of one from the network: parsed, a
/// foreign one could take a hundred times its bytes. False when it is damaged or beyond them.
bool parse_recipe(std::string_view bytes, Recipe& recipe);

}  // namespace oblique::protocol
