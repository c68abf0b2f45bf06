#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/programs.h"
#include "tests/system/storms/storm.h"

namespace oblique::test {

/// One cycle of the kill matrix: which program gets which signal at which point, and how it
/// continues.
struct KillCase {
  std::uint64_t seed = 0;
  bool all_in_one = false;  ///< `oblique run`, else programs started one by one
  std::string program;      ///< the target; empty: none, there are repeated disturbances instead
  std::optional<StormKind> storm{};  ///< goes on until the study is done
  std::string point;                 ///< as kill_points.cpp names them
  int occurrence =
      1;           ///< occurrence of the point; for the point `time`: milliseconds after the start
  int signal = 0;  ///< SIGKILL or SIGSTOP
  std::chrono::milliseconds pause{0};  ///< between point and signal
  // For SIGSTOP only.
  std::chrono::milliseconds stopped{0};  ///< for how long
  int then = 0;                          ///< SIGCONT or SIGKILL
  bool server_stops_first = false;       ///< at the end, before the workers

  bool is_killed() const;
};

/// The case of a seed: the entry is seed modulo size of the matrix; other members are random.
KillCase draw_case(std::uint64_t seed);

/// Number of entries of the matrix.
std::uint64_t entries_of_matrix();

/// On one line, for people.
std::string describe(const KillCase& kill_case);

/// "before-send" of "before-send:results".
std::string class_of(const std::string& point);

/// The study of every cycle, and the database of an undisturbed run.
class KillStudy {
 public:
  KillStudy();

  std::string file() const { return folder_.file("matrix.toml"); }
  std::string undisturbed() const { return folder_.file("undisturbed.db"); }

  static constexpr const char* kName = "matrix";
  static constexpr int kFailing =
      2;  ///< points that fail, because their step is above the stability limit

 private:
  TemporaryFolder folder_;
};

struct MatrixReport {
  std::uint64_t cycles = 0;
  std::uint64_t not_struck = 0;       ///< the study ended before the point was reached
  std::vector<std::string> failures;  ///< the case and what was wrong
};

/// Runs the cases of `count` seeds from `first_seed`. Several run at once, because a cycle mostly
/// waits until a stopped process counts as lost.
MatrixReport run_matrix(std::uint64_t first_seed, std::uint64_t count);

/// The first difference between two databases, or an empty text. Compares studies, models and
/// results, row by row and bit by bit, except for values that depend on who solved what and when:
/// numbers given in the order of arrival, times of day, durations, and the key that submitted the
/// study.
std::string first_difference(const std::string& database, const std::string& other);

}  // namespace oblique::test
