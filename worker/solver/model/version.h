#pragma once

#include <string>

namespace oblique::solver {

/// Version of the solver; results of one study come from one version.
std::string solver_version();

}  // namespace oblique::solver
