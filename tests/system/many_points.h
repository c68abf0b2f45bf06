#pragma once

#include <string>
#include <vector>

namespace oblique::test {

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int kSide = 30;  ///< sanitizers make programs about twenty times slower
#else
constexpr int kSide = 140;
#endif

constexpr double kManyPoints = kSide * kSide;
/// Appends to `command` the arguments of a study that takes seconds, so that a test can cause
/// faults while it is solved.
inline std::vector<std::string> many_points(const std::string& name,
                                            std::vector<std::string> command) {
  const std::string count = std::to_string(kSide);
  command.insert(command.end(), {"--preset", "paper", "--H", "1", "--mu", "0.1:2.0:" + count, "--e",
                                 "0.5:1.0:" + count, "--name", name});
  return command;
}

}  // namespace oblique::test
