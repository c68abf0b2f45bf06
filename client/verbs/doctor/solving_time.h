#pragma once

#include "client/verbs/doctor/report.h"

namespace oblique::client::doctor {

/// How long cases of the default model take on one core: one by one, and side by side in lanes.
/// Solves for less than a second, less where the machine is quick.
Findings examine_solver();

}  // namespace oblique::client::doctor
