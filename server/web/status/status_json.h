#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "proto/oblique.pb.h"
#include "server/web/status/snapshot.h"

// Studies and workers as the page shows them; README.md has the fields.
namespace oblique::server {

/// With `left_s`, the time left [s]; null while it is unknown.
nlohmann::ordered_json study_json(const protocol::StudyStatus& study);
nlohmann::ordered_json worker_json(const protocol::WorkerStatus& worker);

/// What the page shows of a server, as one line.
std::string overview_json(const Snapshot& snapshot);

}  // namespace oblique::server
