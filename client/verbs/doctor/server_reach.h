#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "client/verbs/doctor/report.h"

namespace oblique::client::doctor {

/// What leads to a server.
struct ServerMeant {
  std::string url;
  std::string key_file = {};  ///< empty: none
};

/// How far one gets with it: address, name, connection, keys, answer. Steps end by themselves; a
/// name service that does not answer may hold up its thread.
Findings examine_server(const ServerMeant& server, std::chrono::steady_clock::time_point end);

}  // namespace oblique::client::doctor
