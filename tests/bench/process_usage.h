#pragma once

#include <sys/types.h>

namespace oblique::bench {

/// Resources that a running process has used so far. All are zero if the process has ended.
struct Usage {
  double cpu_s = 0.0;               ///< CPU time of all threads
  double first_thread_cpu_s = 0.0;  ///< CPU time of the main thread
  double resident_MB = 0.0;
  double peak_MB = 0.0;
};

Usage usage_of(pid_t pid);

}  // namespace oblique::bench
