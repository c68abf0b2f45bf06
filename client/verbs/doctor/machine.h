#pragma once

#include "client/verbs/doctor/report.h"

namespace oblique::client::doctor {

/// System, processor, cores, memory, clock, locale. The machine's name only where it is asked for.
Findings examine_machine(bool with_host_name);

}  // namespace oblique::client::doctor
