#pragma once

#include <string>
#include <vector>

#include <spawn.h>
#include <sys/types.h>

namespace oblique::protocol {

/// What a child process starts with: nothing to read, no signal blocked or ignored, and a process
/// group of its own, so that a Ctrl-C on the terminal is its parent's alone.
class SpawnPlan {
 public:
  SpawnPlan();
  ~SpawnPlan();
  SpawnPlan(const SpawnPlan&) = delete;
  SpawnPlan& operator=(const SpawnPlan&) = delete;

  /// The child has our descriptor under that number.
  void give(int ours, int number);
  /// After all that is given: standard input is empty, and from `number` on there is nothing.
  void close_from(int number);
  /// Starts `program`, a path, with its words, the first of which is its name for those who list
  /// processes, and the environment, which ends with a null. Throws std::system_error.
  pid_t start(const std::string& program, std::vector<std::string> words, char** environment) const;

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

}  // namespace oblique::protocol
