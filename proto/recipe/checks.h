#pragma once

#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

// The rules for studies. Parsers of files and flags call these functions, and the server calls them
// again for a received study. Every InputError has the key.
namespace oblique::protocol {

/// Throws InputError, which names key, value and what is allowed, unless the axis is a list, a
/// rising range, an expression or, in a sample, a distribution, and each value is finite and in the
/// key's domain. Except in a zip a list must not have a value twice. Of an expression only the text
/// is checked. Reads each value of a list, and three of a range.
void check_axis(const Axis& axis, BlockKind kind = BlockKind::kProduct);

/// The same for the two ends of a range whose count is not known yet.
void check_ends(const solver::ParameterKey& key, double from, double to);

/// Throws InputError unless the axes of a block are allowed, each once, in order, and fit the kind
/// of the block, and no H is larger than the length of the shortest finger of the block. H is not
/// compared with the length in blocks where this depends on the point (`is_judged_by_points`).
void check_block(const solver::ModelParameters& model, const Block& block);

/// Whether some values, or whether H is within the finger's length, can be checked only point by
/// point.
bool is_judged_by_points(const solver::ModelParameters& model, const Block& block);

/// Calls `work`. An InputError that it throws gets the key and the expression.
template <typename Work>
auto in_expression(std::string_view key, std::string_view text, Work work) {
  try {
    return work();
  } catch (const solver::InputError& error) {
    throw solver::InputError(
        {.text = error.fields().text, .key = std::string(key), .expression = excerpt(text)});
  }
}

/// Throws InputError for a recipe that is too long to be sent to a worker in one frame.
void check_size(const Recipe& recipe);

/// Parses a recipe from a database file, with the same limits as for one from the network, because
/// a parsed recipe can take a hundred times the memory of its bytes. False when it is damaged or
/// exceeds them.
bool parse_recipe(std::string_view bytes, Recipe& recipe);

}  // namespace oblique::protocol
