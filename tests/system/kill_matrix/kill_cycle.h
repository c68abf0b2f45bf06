#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/programs.h"
#include "tests/system/storms/storm.h"

namespace oblique::test {

/// A cycle of the kill matrix: a signal, when and to which process it is sent, how a halt ends.
struct KillCase {
  std::uint64_t seed = 0;
  bool all_in_one = false;           ///< true: `oblique run` starts all programs
  std::string program;               ///< program that gets the signal; empty: no signal or a storm
  std::optional<StormKind> storm{};  ///< storm that lasts until the study is done
  std::string point;                 ///< name of a point in kill_points.cpp
  int occurrence = 1;  ///< n-th arrival at the point; for `time`: milliseconds after the start
  int signal = 0;      ///< SIGKILL or SIGSTOP
  std::chrono::milliseconds pause{0};  ///< delay of the signal after the point
  // For SIGSTOP only.
  std::chrono::milliseconds stopped{0};  ///< duration of the halt
  int then = 0;                          ///< signal after the halt: SIGCONT or SIGKILL
  bool server_stops_first = false;       ///< false: the workers stop before the server

  bool is_killed() const;
};

/// Returns the case of a seed. Its entry in the matrix is `seed` modulo the number of entries. The
/// seed also determines all random choices.
KillCase draw_case(std::uint64_t seed);

/// Returns the number of entries of the matrix.
std::uint64_t entries_of_matrix();

/// Returns a description of the case on one line.
std::string describe(const KillCase& kill_case);

/// Returns the class of a point, such as "before-send" for "before-send:results".
std::string class_of(const std::string& point);

/// The study of all cycles, and the database of an undisturbed run.
class KillStudy {
 public:
  KillStudy();

  std::string file() const { return folder_.file("matrix.toml"); }
  std::string undisturbed() const { return folder_.file("undisturbed.db"); }

  static constexpr const char* kName = "matrix";
  static constexpr int kFailing = 2;  ///< number of points that fail, because a step is unstable

 private:
  TemporaryFolder folder_;
};

struct MatrixReport {
  std::uint64_t cycles = 0;
  std::uint64_t not_reached = 0;      ///< cycles whose study ended before the signal
  std::vector<std::string> failures;  ///< case and reason
};

/// Runs the cases of `count` seeds from `first_seed`. Cycles run in parallel, because a cycle
/// mostly waits until a halted process counts as lost.
MatrixReport run_matrix(std::uint64_t first_seed, std::uint64_t count);

/// Returns the first difference between two databases, or an empty text. Compares studies, models
/// and results bit by bit, except columns that depend on chance: numbers given in order of arrival,
/// times, durations, attempts, workers, and the submitter's key.
std::string first_difference(const std::string& database, const std::string& other);

}  // namespace oblique::test
