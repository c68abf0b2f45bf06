#pragma once

#include <cstdint>

namespace oblique::simulation {

class SimulatedFiles;

/// SQLite finds these files at their path from now on, and draws its random numbers from `seed`.
void add_to_vfs(SimulatedFiles& files, std::uint64_t seed);
void remove_from_vfs(SimulatedFiles& files);

}  // namespace oblique::simulation
