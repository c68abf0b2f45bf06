#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

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

struct MatrixReport {
  std::uint64_t cycles = 0;
  std::uint64_t not_struck = 0;       ///< the study ended before the point was reached
  std::map<std::string, int> blows;   ///< by program and signal
  std::vector<std::string> failures;  ///< the case and what was wrong
};

/// Runs the cases of `count` seeds from `first_seed`, several at once: most of their time they wait
/// for somebody to be given up.
MatrixReport run_matrix(std::uint64_t first_seed, std::uint64_t count);

/// The first difference between two databases in what must not depend on who solved what and when:
/// studies, models and results, row for row and to the last bit, without numbers given in order of
/// arrival, times of day, durations, and by whose key a study came, which is none without keys.
/// Empty when there is none.
std::string first_difference(const std::string& database, const std::string& other);

}  // namespace oblique::test
