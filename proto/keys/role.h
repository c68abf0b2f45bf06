#pragma once

#include <optional>
#include <string_view>

namespace oblique::protocol {

/// What the holder of a key is to the server.
enum class Role {
  kServer,
  kClient,  ///< may ask and change everything at the port for clients
  kWorker,  ///< may solve at the port for workers
  kReader,  ///< may ask at the port for clients, and change nothing
};

/// "server", "client", "worker" or "reader".
std::string_view name_of(Role role);
std::optional<Role> role_named(std::string_view name);

}  // namespace oblique::protocol
