#pragma once

#include <cstdint>

#include "server/web/http/http_server.h"
#include "server/web/snapshot.h"

// Whether the server lives and takes work, as answers of one sentence.
namespace oblique::server {

/// It lives while its loop turned within the last five seconds.
HttpAnswer health(std::int64_t turned_ms, std::int64_t now_ms);

/// It takes work unless it stops, the database takes no results, or the disk is about to be full.
HttpAnswer readiness(const Snapshot& snapshot, double free_bytes);

/// With less room than this a server is not ready: a million results take 375 MB.
inline constexpr double kLeastFree_bytes = 64.0 * 1024 * 1024;

}  // namespace oblique::server
