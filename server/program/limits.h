#pragma once

#include <CLI/CLI.hpp>

#include "server/network/network.h"
#include "server/query/query_pool.h"
#include "server/service/service.h"

namespace oblique::server {

/// Adds an option --limits-KEY for each bound that people may set, which --help does not show. All
/// of the structures must outlive `app`; what they hold is the default.
void add_limits(CLI::App& app, NetworkLimits& network, ServiceSettings& service,
                QueueSettings& queries);

}  // namespace oblique::server
