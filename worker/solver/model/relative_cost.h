#pragma once

#include <optional>

#include "worker/solver/model/parameters.h"

namespace oblique::solver {

/// How many times as long a point of `model` takes as one of the preset `standard`, its fall aside:
/// a rough number, by mesh and tolerance alone. Nothing where steps do not follow from these: with
/// generalized-alpha, and with a dt that was asked for.
std::optional<double> relative_cost(const ModelParameters& model);

}  // namespace oblique::solver
