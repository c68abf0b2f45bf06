#pragma once

#include <nlohmann/json.hpp>

#include "proto/oblique.pb.h"

// Studies and workers as the page has them.
namespace oblique::server {

/// With `left_s`, the time left in seconds: null while nothing tells it.
nlohmann::ordered_json study_json(const protocol::StudyStatus& study);
nlohmann::ordered_json worker_json(const protocol::WorkerStatus& worker);

}  // namespace oblique::server
