#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// Most links of a model, and so most single lengths.
inline constexpr std::size_t kMostLinks = 64;

/// Keys of axes have numbers: those of a model in the order of listings, then the single lengths
/// `length1`, `length2`, ..., of the links from the pin outwards, then H, mu and e. Throws
/// InputError for an unknown one, with the nearest and the list of all.
std::size_t key_number(std::string_view name);

/// The key of that number, and how many there are.
const solver::ParameterKey& key_numbered(std::size_t number);
std::size_t key_count();

/// The model or point key called `name`. Throws as `key_number` does.
const solver::ParameterKey& axis_key(std::string_view name);

/// Whether there is such a key.
bool is_axis_key(std::string_view name);

/// Whether the key of that number belongs to the point, as H, mu and e do, and not to its model.
bool is_point_key(std::size_t number);

/// The link, from 0, whose length the key of that number is; nothing for all other keys. Single
/// lengths act on what `links` and `length` have made.
std::optional<std::size_t> link_of_key(std::size_t number);

}  // namespace oblique::protocol
