#pragma once

#include <string>

#include "proto/system/descriptor.h"

namespace oblique::server {

/// A TCP socket that takes connections, non-blocking.
class Listener {
 public:
  /// `address` is numeric, `port` a number or "*": the system picks one. Throws std::runtime_error,
  /// naming the endpoint, when it cannot listen there.
  Listener(const std::string& address, const std::string& port);

  /// With the port that is really used, as tcp://127.0.0.1:7601.
  const std::string& endpoint() const { return endpoint_; }
  int descriptor() const { return socket_.number(); }

  /// The next connection, non-blocking; none when none waits or the system gives none. Then `errno`
  /// says which.
  protocol::Descriptor accept() const;

 private:
  protocol::Descriptor socket_;
  std::string endpoint_;
};

}  // namespace oblique::server
