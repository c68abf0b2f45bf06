#pragma once

#include <string>

#include "server/web/snapshot.h"

namespace oblique::server {

/// What the page shows of a server, as one line of JSON; server/web/page/README.md has its fields.
std::string overview_json(const Snapshot& snapshot);

}  // namespace oblique::server
