#pragma once

#include <string_view>

#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

// The rules for studies. Parsers of files and flags call these functions, and the server calls them
// again for a received study. Every InputError has the key.
namespace oblique::protocol {

/// Throws InputError unless the ends of a range are allowed and rise.
void check_ends(const solver::ParameterKey& key, double from, double to);

/// Throws InputError, which names key, value and what is allowed, unless each axis of a block is a
/// list, a rising range, an expression or, in a sample, a distribution, and each value is finite
/// and in the key's domain; unless the axes are in order, each once, and fit the kind of the block,
/// and no H is larger than the length of the shortest finger of the block. H is not compared with
/// the length in blocks where this depends on the point (`is_judged_by_points`).
void check_block(const solver::ModelParameters& model, const Block& block);

/// Whether some values, or whether H is within the finger's length, can be checked only point by
/// point.
bool is_judged_by_points(const solver::ModelParameters& model, const Block& block);

/// Throws InputError for a recipe that is too long to be sent to a worker in one frame.
void check_size(const Recipe& recipe);

/// Parses a recipe from a database file, with the same limits as for one from the network, because
/// a parsed recipe can take a hundred times the memory of its bytes. False when it is damaged or
/// exceeds them.
bool parse_recipe(std::string_view bytes, Recipe& recipe);

}  // namespace oblique::protocol
