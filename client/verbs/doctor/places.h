#pragma once

#include <string>

#include "client/verbs/doctor/report.h"

namespace oblique::client::doctor {

/// The disk that holds, or would hold, the database `file`.
Findings examine_disk(const std::string& file);

/// The database `file`, read without making a file beside it. Nothing is said of damage, which
/// `oblique check` looks for. A file that is not there is a fault where `is_named`.
Findings examine_database(const std::string& file, bool is_named);

}  // namespace oblique::client::doctor
