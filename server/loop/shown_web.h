#pragma once

#include <memory>

#include "server/loop/loop.h"

namespace oblique::server {

/// What shows the server over HTTP: null when nothing is to be shown, or cannot be and need not,
/// which is logged. Throws std::runtime_error when it cannot be and must.
std::unique_ptr<Web> web_of(const LoopSettings& settings);

}  // namespace oblique::server
