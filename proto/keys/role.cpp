#include "proto/keys/role.h"

#include <array>

namespace oblique::protocol {

std::string_view name_of(Role role) {
  switch (role) {
    case Role::kServer:
      return "server";
    case Role::kClient:
      return "client";
    case Role::kWorker:
      return "worker";
    case Role::kReader:
      break;
  }
  return "reader";
}

std::optional<Role> role_named(std::string_view name) {
  for (const Role role : {Role::kServer, Role::kClient, Role::kWorker, Role::kReader}) {
    if (name == name_of(role)) {
      return role;
    }
  }
  return std::nullopt;
}

}  // namespace oblique::protocol
