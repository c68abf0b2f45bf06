#pragma once

#include <string>
#include <vector>

#include "client/verbs/doctor/report.h"

namespace oblique::client::doctor {

/// Variables that programs of oblique read, key files that are meant, and the program that makes
/// PNG. Of a key nothing is shown but whether it can be used; of a variable that nothing here reads
/// only the name. `key_file`: named by a flag, or empty.
Findings examine_settings(const std::string& key_file);

}  // namespace oblique::client::doctor
