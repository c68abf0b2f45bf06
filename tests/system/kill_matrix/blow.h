#pragma once

#include <string>
#include <thread>

#include "tests/support/programs.h"
#include "tests/system/kill_matrix/kill_case.h"

namespace oblique::test {

/// The one blow of a cycle. The struck process does it to itself, by the library kill_points; here
/// it is armed for it, and wakes or ends when it was halted.
class Blow {
 public:
  Blow(const TemporaryFolder& folder, const KillCase& kill_case);
  Blow(const Blow&) = delete;
  Blow& operator=(const Blow&) = delete;

  /// What `program` is started with: with the order when it is the one that is meant.
  Environment environment(const std::string& program) const;
  /// What a process is started with that is to be left alone.
  Environment bystander() const;

  bool has_struck() const;
  /// Whether that exit code of that program is the blow's. Only once: it strikes one process.
  bool explains(const std::string& program, int exit_code);

 private:
  void end_the_halt(const std::stop_token& stop) const;
  /// The process that was struck; −1 when none is yet.
  pid_t struck() const;

  const KillCase& case_;
  std::string folder_;
  std::string mark_;
  std::string library_;
  bool explained_ = false;
  std::jthread halt_;  ///< last, as it uses the others
};

}  // namespace oblique::test
