#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// Keys of axes have numbers: those of a model in the order of listings and, after them, H, mu and
/// e. Throws InputError for an unknown one, with the nearest and the list of all.
std::size_t key_number(std::string_view name);

/// The key of that number, and how many there are.
const solver::ParameterKey& key_numbered(std::size_t number);
std::size_t key_count();

/// The model or point key called `name`. Throws as `key_number` does.
const solver::ParameterKey& axis_key(std::string_view name);

/// A key from outside that is none, for the beginning of a sentence, with the nearest of `known`:
/// "unknown key `muu` (did you mean `mu`?)". Long ones only by their length.
std::string unknown_key(std::string_view name, std::span<const std::string_view> known);

}  // namespace oblique::protocol
