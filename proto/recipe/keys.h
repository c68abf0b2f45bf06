#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// Most links of a model.
inline constexpr std::size_t kMostLinks = 64;

/// Keys of axes have numbers: those of a model in the order of listings, then the single lengths
/// `length1`, `length2`, ... from the pin outwards, then H, mu and e. Throws InputError for an
/// unknown key, with the nearest and the list of all.
std::size_t key_number(std::string_view name);
/// The key called `name`; throws as `key_number` does.
const solver::ParameterKey& axis_key(std::string_view name);
bool is_axis_key(std::string_view name);

const solver::ParameterKey& key_numbered(std::size_t number);
std::size_t key_count();

/// Whether the key is H, mu or e, and not one of the model.
bool is_point_key(std::size_t number);

/// The link, from 0, of a single length. Single lengths act on what `links` and `length` have made.
std::optional<std::size_t> link_of_key(std::size_t number);

}  // namespace oblique::protocol
