#pragma once

#include "proto/oblique.pb.h"
#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// Every parameter of a model.
ModelParameters to_message(const solver::ModelParameters& model);

/// Throws solver::InputError when the message is outside the model's domain.
solver::ModelParameters from_message(const ModelParameters& message);

/// The same for a model that may be outside its domain, for example one that an earlier version
/// stored. Throws solver::InputError only for numbers that the struct cannot hold.
solver::ModelParameters unjudged_from_message(const ModelParameters& message);

}  // namespace oblique::protocol
