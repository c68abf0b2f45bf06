#pragma once

#include <optional>

#include "proto/program/completion/offers.h"

namespace oblique::client {

/// What a value of a verb may be beyond what its option tells: columns, keys of models, files by
/// what is in them.
std::optional<protocol::Offers> values_of_verbs(const protocol::Typed& typed);

}  // namespace oblique::client
