#pragma once

#include <cstdint>

#include "worker/solver/model/parameters.h"

namespace oblique::solver {

/// `model` with everything that its fall does not depend on (k, eta2, dt, a tolerance looser
/// than the default, and spectral_radius where no method reads it) at its default. Models share a
/// fall exactly when this gives the same.
ModelParameters fall_model(const ModelParameters& model);

/// Solved falls may take one part in so many of the memory that a process can have.
inline constexpr std::uint64_t kFallsPartOfMemory = 8;

/// Whether models that differ from `model` in that key alone have another fall.
bool changes_fall(const ParameterKey& key, const ModelParameters& model);

/// The same number for models that share a fall; different ones share it by rare accident.
std::uint64_t fall_hash(const ModelParameters& model);

}  // namespace oblique::solver
