#include "client/autoscale/command.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <thread>

#include <spdlog/fmt/fmt.h>

#include "client/service/child_process.h"
#include "client/service/connection.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBetweenLooks{5};
constexpr std::size_t kMostBytes = std::size_t{16} << 20U;

/// One line, for a sentence.
std::string with_words(const std::string& what, const ChildProcess& child, bool last_line) {
  auto words = child.last_words();
  if (last_line) {
    words.erase(0, words.rfind('\n') + 1);
  }
  std::replace(words.begin(), words.end(), '\n', ' ');
  return words.empty() ? what : fmt::format("{}: {}", what, words);
}

}  // namespace

std::string output_of(const CommandSettings& command) {
  try {
    ChildProcess child({.program = command.program,
                        .arguments = command.arguments,
                        .keep_output = true,
                        .hidden_variables = command.hidden_variables});
    const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                             std::chrono::duration<double>(command.timeout_s));
    while (child.is_running()) {
      if (command.keep_waiting && !command.keep_waiting()) {
        throw Interrupted("stopped while waiting for " + command.program);
      }
      if (Clock::now() > deadline) {
        throw CommandError(with_words(fmt::format("{} took longer than {} s", command.program,
                                                  solver::readable_number(command.timeout_s)),
                                      child, command.tells_last_line));
      }
      std::this_thread::sleep_for(kBetweenLooks);
    }
    if (!child.succeeded()) {
      throw CommandError(with_words(fmt::format("{} {}", command.program, child.ending()), child,
                                    command.tells_last_line));
    }
    return child.output(kMostBytes);
  } catch (const ProgramNotFound&) {
    throw CommandNotFound(command.program + " is not in PATH");
  } catch (const ProcessError& error) {
    throw CommandError(fmt::format("{}: {}", command.program, error.what()));
  }
}

}  // namespace oblique::client
