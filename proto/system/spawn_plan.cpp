#include "proto/system/spawn_plan.h"

#include <csignal>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace oblique::protocol {

SpawnPlan::SpawnPlan() {
  posix_spawn_file_actions_init(&actions_);
  posix_spawnattr_init(&attributes_);
  sigset_t signals;
  sigemptyset(&signals);
  posix_spawnattr_setsigmask(&attributes_, &signals);
  sigfillset(&signals);
  posix_spawnattr_setsigdefault(&attributes_, &signals);
  posix_spawnattr_setpgroup(&attributes_, 0);
  posix_spawnattr_setflags(&attributes_,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
}

SpawnPlan::~SpawnPlan() {
  posix_spawn_file_actions_destroy(&actions_);
  posix_spawnattr_destroy(&attributes_);
}

void SpawnPlan::give(int ours, int number) {
  posix_spawn_file_actions_adddup2(&actions_, ours, number);
}

void SpawnPlan::close_from(int number) {
  posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addclosefrom_np(&actions_, number);
}

pid_t SpawnPlan::start(const std::string& program, std::vector<std::string> words,
                       char** environment) const {
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) {
    arguments.push_back(word.data());
  }
  arguments.push_back(nullptr);
  pid_t pid = -1;
  const int error =
      posix_spawn(&pid, program.c_str(), &actions_, &attributes_, arguments.data(), environment);
  if (error != 0) {
    throw std::system_error(error, std::generic_category(), program);
  }
  return pid;
}

}  // namespace oblique::protocol
