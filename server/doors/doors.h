#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/doors/listening.h"

namespace oblique::server {

/// Where the server listens and what it says of that.
class Doors {
 public:
  /// Throws as `address_to_bind`.
  explicit Doors(const DoorSettings& settings);

  /// As `address_to_bind` gives it.
  const std::string& address() const { return address_; }
  Access access() const { return access_; }

  /// A warning that is due for the log: at once, and again every ten minutes, while anybody may
  /// come in. Milliseconds of a clock that never runs backwards.
  std::optional<std::string> warning(std::int64_t now_ms);

 private:
  std::string address_;
  Access access_;
  std::int64_t next_warning_ms_ = INT64_MIN;
};

}  // namespace oblique::server
