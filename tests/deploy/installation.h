#pragma once

#include <string>
#include <vector>

#include "tests/support/process.h"

namespace oblique::test {

/// Runs `program`, found by PATH unless it is one, to its end in `folder`.
inline Outcome run_tool(const TemporaryFolder& folder, const std::string& program,
                        const std::vector<std::string>& arguments,
                        const Environment& environment = {}) {
  std::vector<std::string> line{program};
  line.insert(line.end(), arguments.begin(), arguments.end());
  Process process(folder, "/usr/bin/env", line, environment);
  return process.outcome();
}

/// Whether PATH has this program.
inline bool is_there(const TemporaryFolder& folder, const std::string& program) {
  return run_tool(folder, "which", {program}).exit_code == 0;
}

/// Installs `component`, or all where it is empty, for `prefix`, below `destination` where that is
/// not empty. What cmake --install said.
Outcome install(const TemporaryFolder& folder, const std::string& prefix,
                const std::string& component = "", const std::string& destination = "");

}  // namespace oblique::test
