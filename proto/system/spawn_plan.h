#pragma once

#include <csignal>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/types.h>
#include <unistd.h>

namespace oblique::protocol {

/// Starts a child process with nothing to read, no signal blocked or ignored, and a process group
/// of its own, so that a Ctrl-C on the terminal reaches only its parent.
class SpawnPlan {
 public:
  SpawnPlan() {
    posix_spawn_file_actions_init(&actions_);
    posix_spawnattr_init(&attributes_);
    sigset_t signals;
    sigemptyset(&signals);
    posix_spawnattr_setsigmask(&attributes_, &signals);
    sigfillset(&signals);
    posix_spawnattr_setsigdefault(&attributes_, &signals);
    posix_spawnattr_setpgroup(&attributes_, 0);
    posix_spawnattr_setflags(
        &attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  }
  ~SpawnPlan() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  SpawnPlan(const SpawnPlan&) = delete;
  SpawnPlan& operator=(const SpawnPlan&) = delete;

  /// The child has our descriptor under that number.
  void give(int ours, int number) { posix_spawn_file_actions_adddup2(&actions_, ours, number); }
  /// Call it last: standard input is empty, and descriptors from `number` on are closed.
  void close_from(int number) {
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addclosefrom_np(&actions_, number);
  }
  /// Starts `program`, a path, with the arguments `words`, the first of which is its name, and the
  /// environment, which ends with a null. Throws std::system_error.
  pid_t start(const std::string& program, std::vector<std::string> words,
              char** environment) const {
    std::vector<char*> arguments;
    for (std::string& word : words) {
      arguments.push_back(word.data());
    }
    arguments.push_back(nullptr);
    pid_t pid = -1;
    if (const int error = posix_spawn(&pid, program.c_str(), &actions_, &attributes_,
                                      arguments.data(), environment)) {
      throw std::system_error(error, std::generic_category(), program);
    }
    return pid;
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

}  // namespace oblique::protocol
