#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/system/storms/storm.h"

namespace oblique::test {

/// What is struck in one cycle of the kill matrix, where, and what becomes of it.
struct KillCase {
  std::uint64_t seed = 0;
  bool all_in_one = false;  ///< `oblique run`, else programs started one by one
  std::string program;      ///< who is struck; empty: nobody, there is a storm in its place
  std::optional<StormKind> storm{};  ///< goes on until the study is done
  std::string point;                 ///< as kill_points.cpp names them
  int occurrence = 1;  ///< at which one; of the point `time`: milliseconds after the start
  int signal = 0;      ///< SIGKILL or SIGSTOP
  std::chrono::milliseconds pause{0};  ///< between point and signal
  // Of SIGSTOP only.
  std::chrono::milliseconds stopped{0};  ///< for how long
  int then = 0;                          ///< SIGCONT or SIGKILL
  bool server_stops_first = false;       ///< at the end, before the workers

  bool is_killed() const;
};

/// The case of a seed: the entry of the matrix goes round with the seed, the rest is drawn from it.
KillCase draw_case(std::uint64_t seed);

/// Cases until each entry of the matrix has had its turn.
std::uint64_t entries_of_matrix();

/// On one line, for people.
std::string describe(const KillCase& kill_case);

/// "before-send" of "before-send:results".
std::string class_of(const std::string& point);

}  // namespace oblique::test
