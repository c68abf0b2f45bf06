#pragma once

#include <optional>
#include <string>

#include "tests/support/programs.h"
#include "tests/system/kill_matrix/kill_case.h"

namespace oblique::test {

/// The study of every cycle, and the database of a run of it in which nothing happened.
class KillStudy {
 public:
  KillStudy();

  std::string file() const { return folder_.file("matrix.toml"); }
  std::string undisturbed() const { return folder_.file("undisturbed.db"); }

  static constexpr const char* kName = "matrix";
  static constexpr int kFailing = 2;  ///< points whose step is beyond the limit of stability

 private:
  TemporaryFolder folder_;
};

struct CycleOutcome {
  bool struck = false;                 ///< the point was reached
  std::optional<std::string> failure;  ///< what was wrong, with what the processes said
};

/// Runs the study in a folder of its own, with the blow of the case, to its end, and compares what
/// is stored with the undisturbed database.
CycleOutcome run_cycle(const KillStudy& study, const KillCase& kill_case);

}  // namespace oblique::test
