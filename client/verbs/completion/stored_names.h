#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "client/service/source_flags.h"

namespace oblique::client {

/// Names of studies that begin so, in the order of their bytes: where there are very many the first
/// of them and the last. None where nobody answers within a few milliseconds, or no database is
/// there; nothing is made or changed by being asked after.
std::vector<std::string> names_in_database(const std::string& file, const std::string& begin);
std::vector<std::string> names_at_server(const SourceFlags& flags, const std::string& begin);

/// How long a server may take, so that the whole answer takes no more than 20 ms, when the
/// program's beginning took `spent` of these; a little even where it took them all.
std::chrono::milliseconds patience_left(std::chrono::milliseconds spent);

}  // namespace oblique::client
