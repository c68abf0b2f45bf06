#pragma once

#include <sys/types.h>

namespace oblique::bench {

/// What a living process has used so far; zeros for one that is gone.
struct Usage {
  double cpu_s = 0.0;               ///< of all its threads
  double first_thread_cpu_s = 0.0;  ///< of the one that it began with
  double resident_MB = 0.0;
  double peak_MB = 0.0;
};

Usage usage_of(pid_t pid);

}  // namespace oblique::bench
