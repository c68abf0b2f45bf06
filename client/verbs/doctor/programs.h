#pragma once

#include <chrono>

#include "client/verbs/doctor/report.h"

namespace oblique::client::doctor {

/// This program, what it is linked with, and the programs beside it, which have until `end` to say
/// their version.
Findings examine_programs(std::chrono::steady_clock::time_point end);

}  // namespace oblique::client::doctor
