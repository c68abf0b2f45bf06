#include "worker/supervisor.h"

#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include "proto/system/descriptor.h"
#include "proto/text.h"

namespace oblique::worker {
namespace {

/// Signals that report an error of the program. Other signals come from outside.
constexpr std::array kCrashes{SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT};

void check_call(bool is_done, const char* what) {
  if (!is_done) {
    throw std::system_error(errno, std::generic_category(), what);
  }
}

/// Adds the points that the child was solving. Adds none while a trace was being solved, because
/// the trace may have caused the crash.
void add_points(std::span<SolvingSlot> slots, protocol::EndedProcess& ended) {
  for (const SolvingSlot& slot : slots) {
    for (const std::uint64_t point : slot.points) {
      if (point != 0 && &slot == &slots.front()) {
        return;
      }
      if (point != 0) {
        ended.add_points(slot.study_id);
        ended.add_points((point & ~SolvingSlot::kFall) - 1);
      }
    }
  }
}

/// Returns the pause before the next child, when `in_vain` children in a row have solved nothing.
std::chrono::milliseconds pause_after(unsigned in_vain) {
  constexpr unsigned kMostDoublings = 8;  // 12.8 s
  return std::chrono::milliseconds(in_vain < 2 ? 0 : 50U << std::min(in_vain - 2, kMostDoublings));
}

}  // namespace

std::span<SolvingSlot> make_shared_slots(std::size_t threads) {
  void* const memory = mmap(nullptr, (threads + 1) * sizeof(SolvingSlot), PROT_READ | PROT_WRITE,
                            MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  check_call(memory != MAP_FAILED, "no shared memory");
  return {static_cast<SolvingSlot*>(memory), threads + 1};
}

int supervise(protocol::StopSignals& stop, std::span<SolvingSlot> slots,
              const std::function<int(const protocol::WorkerHello& hello, int forwarder)>& work) {
  constexpr const char* kNoProcess = "no process can be started to solve";
  const protocol::Notifier systemd;
  protocol::WorkerHello hello;
  for (unsigned in_vain = 0; !stop.wait(pause_after(in_vain));) {
    hello.set_process_id(protocol::random_id());
    std::uninitialized_value_construct(slots.begin(), slots.end());
    int ends[2];
    check_call(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) == 0, kNoProcess);
    const protocol::Descriptor states(ends[0]);
    protocol::Descriptor held(ends[1]);  // after the fork only the child keeps this end open
    const pid_t parent = getpid();
    const pid_t child = fork();
    check_call(child >= 0, kNoProcess);
    if (child == 0) {
      // When memory runs out, the system ends this process rather than the parent.
      std::ofstream("/proc/self/oom_score_adj") << "100";
      return protocol::stop_with_parent(parent) ? work(hello, held.number()) : 0;
    }
    held.close();
    bool is_stopping = false;
    pollfd items[] = {{stop.descriptor(), POLLIN, 0}, {states.number(), POLLIN, 0}};
    std::array<char, 4096> state{};
    for (ssize_t size = 1; size > 0;) {  // 0: the child has ended
      if (poll(items, std::size(items), -1) <= 0) {
        continue;
      }
      if (items[0].revents != 0) {
        is_stopping = true;
        stop.requested();
        kill(child, SIGTERM);
      }
      if (items[1].revents != 0) {
        size = recv(states.number(), state.data(), state.size(), 0);
        if (size > 0) {
          systemd.send({state.data(), static_cast<std::size_t>(size)});
        }
      }
    }
    int status = 0;
    check_call(waitpid(child, &status, 0) == child, kNoProcess);
    if (WIFEXITED(status) || is_stopping) {
      return WIFEXITED(status) ? WEXITSTATUS(status) : 0;
    }
    protocol::EndedProcess ended;
    ended.set_process_id(hello.process_id());
    ended.set_signal(WTERMSIG(status));
    if (std::ranges::count(kCrashes, ended.signal()) > 0) {
      add_points(slots, ended);
    }
    spdlog::warn("signal {} ({}) ended the process that solves; another one starts", ended.signal(),
                 strsignal(ended.signal()));
    const auto has_solved = [](const SolvingSlot& slot) { return slot.solved > 0; };
    in_vain = std::ranges::any_of(slots, has_solved) ? 0 : in_vain + 1;
    // A child that solved nothing may have ended before it reported the end of the one before.
    if (in_vain == 0 || ended.points_size() > 0) {
      *hello.mutable_replaced() = std::move(ended);
    }
  }
  return 0;
}

}  // namespace oblique::worker
