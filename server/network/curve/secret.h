#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>

#include <sodium.h>

#include "proto/keys/curve_key.h"

namespace oblique::server {

inline constexpr std::size_t kKeyBytes = std::tuple_size_v<protocol::CurveKey>;

/// A key of one connection, wiped when it is no longer needed. It is not locked in memory:
/// thousands of them would exceed what the system permits.
class Secret {
 public:
  Secret() = default;
  Secret(const Secret&) = default;
  Secret& operator=(const Secret&) = default;
  ~Secret() { wipe(); }

  void wipe() { sodium_memzero(bytes_.data(), bytes_.size()); }
  const std::uint8_t* data() const { return bytes_.data(); }
  std::uint8_t* data() { return bytes_.data(); }

 private:
  protocol::CurveKey bytes_{};
};

}  // namespace oblique::server
