#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/keys/key_file.h"
#include "server/doors/key_list.h"
#include "server/doors/listening.h"
#include "server/network/curve/doorkeeper.h"

namespace oblique::server {

/// Where the server listens, whom it lets in, and what it says of that.
class Doors {
 public:
  /// Reads the server's key and the list beside it. Throws as `address_to_bind`, and
  /// solver::InputError for files that cannot be used.
  explicit Doors(const DoorSettings& settings);

  /// As `address_to_bind` gives it.
  const std::string& address() const { return address_; }
  Access access() const { return access_; }
  /// What guards the port for clients, or for workers; none: nothing.
  std::optional<PortGuard> guard(PortKeeper::Port port) const;

  struct Line {
    bool is_warning;
    std::string text;
  };
  struct News {
    bool admission_changed = false;  ///< the network must ask again who may stay
    std::vector<Line> lines;         ///< for the log
  };
  /// Looks, twice a second, whether the list of keys has changed; says at the start what guards the
  /// server, and every ten minutes when nothing does. To be called often, with milliseconds of a
  /// clock that never runs backwards.
  News look(std::int64_t now_ms);

 private:
  std::string address_;
  Access access_;
  std::optional<protocol::KeyFile> key_;
  std::shared_ptr<KeyList> list_;
  bool is_introduced_ = false;
  std::int64_t next_look_ms_ = INT64_MIN;
  std::int64_t next_warning_ms_ = INT64_MIN;
};

}  // namespace oblique::server
