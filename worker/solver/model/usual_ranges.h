#pragma once

#include <string>
#include <string_view>

#include "worker/solver/model/parameters.h"

// Values that parameters of real fingers have. Others are computed as well: they are likely to be
// in another unit.
namespace oblique::solver {

/// "E = 70000 Pa is softer than rubber; 7e10?" for a value outside the usual range of its key, with
/// the value that a power of 1000 brings into it. Empty for all other values and keys.
std::string note_on_value(const ParameterKey& key, double value);

/// `error` of a fall or a contact, and "; likely cause: E = 70 Pa is outside the usual 1e8 to
/// 1e12 Pa" for each parameter of the model that is.
std::string with_likely_cause(std::string error, const ModelParameters& model);

}  // namespace oblique::solver
