#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/programs.h"
#include "tests/system/storms/storm.h"

namespace oblique::test {

/// One cycle of the kill matrix: which process gets which signal, where, and what follows.
struct KillCase {
  std::uint64_t seed = 0;
  bool all_in_one = false;           ///< `oblique run`; otherwise each program is started apart
  std::string program;               ///< that gets the signal; empty: none, or a storm
  std::optional<StormKind> storm{};  ///< continues until the study is done
  std::string point;                 ///< as kill_points.cpp names them
  int occurrence = 1;  ///< of the point, from 1; for `time`: milliseconds after the start
  int signal = 0;      ///< SIGKILL or SIGSTOP
  std::chrono::milliseconds pause{0};  ///< between point and signal
  // For SIGSTOP only.
  std::chrono::milliseconds stopped{0};  ///< duration of the halt
  int then = 0;                          ///< SIGCONT or SIGKILL, after the halt
  bool server_stops_first = false;       ///< at the end; otherwise the workers stop first

  bool is_killed() const;
};

/// The case of a seed: entry `seed` modulo the size of the matrix; the rest is drawn at random from
/// the seed.
KillCase draw_case(std::uint64_t seed);

/// Number of entries of the matrix.
std::uint64_t entries_of_matrix();

/// Description on one line.
std::string describe(const KillCase& kill_case);

/// "before-send" of "before-send:results".
std::string class_of(const std::string& point);

/// The study of all cycles, and the database of an undisturbed run.
class KillStudy {
 public:
  KillStudy();

  std::string file() const { return folder_.file("matrix.toml"); }
  std::string undisturbed() const { return folder_.file("undisturbed.db"); }

  static constexpr const char* kName = "matrix";
  static constexpr int kFailing = 2;  ///< points that fail: their step is above the stability limit

 private:
  TemporaryFolder folder_;
};

struct MatrixReport {
  std::uint64_t cycles = 0;
  std::uint64_t not_reached = 0;      ///< cycles whose study ended before the point
  std::vector<std::string> failures;  ///< case and reason
};

/// Runs the cases of `count` seeds from `first_seed`. Several run at once, because a cycle mostly
/// waits until a halted process counts as lost.
MatrixReport run_matrix(std::uint64_t first_seed, std::uint64_t count);

/// Returns the first difference between two databases; empty if there is none. Compares all bits of
/// studies, models and results, except columns that depend on chance: numbers given in order of
/// arrival, times, durations, attempts, workers, and the key of the submitter.
std::string first_difference(const std::string& database, const std::string& other);

}  // namespace oblique::test
