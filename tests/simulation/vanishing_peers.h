#pragma once

#include <cstdint>

#include "tests/simulation/network.h"
#include "tests/simulation/world.h"

namespace oblique::simulation {

/// Peers that say that they are workers, ask for many batches, and vanish, each under a name of its
/// own.
class VanishingPeers {
 public:
  VanishingPeers(World& world, Network& network) : world_(world), network_(network) {}

  /// One comes, and vanishes in half a second.
  void come();
  /// How many got a batch of a study.
  std::uint64_t vanished() const { return vanished_; }

 private:
  World& world_;
  Network& network_;
  std::uint64_t came_ = 0;
  std::uint64_t vanished_ = 0;
};

}  // namespace oblique::simulation
