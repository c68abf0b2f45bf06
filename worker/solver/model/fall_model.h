#pragma once

#include "worker/solver/model/parameters.h"

namespace oblique::solver {

/// `model` with everything that its fall does not depend on (k, eta2, dt, a tolerance looser
/// than the default, and spectral_radius where no method reads it) at its default. Models share a
/// fall exactly when this gives the same.
ModelParameters fall_model(const ModelParameters& model);

}  // namespace oblique::solver
