#pragma once

#include <chrono>
#include <cstdint>

#include <unistd.h>

#include "server/network/network.h"
#include "tests/support/hang_limit.h"

namespace oblique::server {

/// Turns the network until `done`. False when it never gets there.
template <typename Done>
bool turn_until(Network& network, std::int64_t now_ms, const Done& done) {
  const auto give_up = std::chrono::steady_clock::now() + test::kHangLimit;
  while (!done()) {
    if (std::chrono::steady_clock::now() > give_up) {
      return false;
    }
    network.collect(now_ms);
    if (!network.has_more()) {
      usleep(1000);
    }
  }
  return true;
}

}  // namespace oblique::server
