#include "tests/system/kill_matrix/blow.h"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace oblique::test {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kBetweenLooks{5};

}  // namespace

Blow::Blow(const TemporaryFolder& folder, const KillCase& kill_case)
    : case_(kill_case),
      folder_(folder.path().string()),
      mark_(folder.file("struck")),
      library_(folder.file("kill_points.so")) {
  // LD_PRELOAD ends a path at a space or colon, which that of the build folder may have.
  std::filesystem::create_symlink(OBLIQUE_KILL_POINTS, library_);
  if (case_.signal == SIGSTOP) {
    halt_ = std::jthread([this](const std::stop_token& stop) { end_the_halt(stop); });
  }
}

Environment Blow::environment(const std::string& program) const {
  Environment all = bystander();
  if (program == case_.program) {
    std::ostringstream order;
    order << case_.program << ' ' << case_.point << ' ' << case_.occurrence << ' ' << case_.signal
          << ' ' << case_.pause.count() << ' ' << mark_;
    all["OBLIQUE_KILL_AT"] = order.str();
    all["LD_PRELOAD"] = library_;
  }
  return all;
}

Environment Blow::bystander() const {
  // By this every process of a cycle is known, those too that its processes start.
  return {{"TMPDIR", folder_}};
}

pid_t Blow::struck() const {
  std::ifstream mark(mark_);
  pid_t pid = -1;
  return mark >> pid ? pid : -1;
}

bool Blow::has_struck() const {
  return struck() > 0;
}

bool Blow::explains(const std::string& program, int exit_code) {
  if (explained_ || program != case_.program || exit_code != -SIGKILL || !case_.is_killed() ||
      !has_struck()) {
    return false;
  }
  explained_ = true;
  return true;
}

void Blow::end_the_halt(const std::stop_token& stop) const {
  while (!stop.stop_requested() && !has_struck()) {
    std::this_thread::sleep_for(kBetweenLooks);
  }
  const auto until = Clock::now() + case_.stopped;
  while (!stop.stop_requested() && Clock::now() < until) {
    std::this_thread::sleep_for(kBetweenLooks);
  }
  if (const pid_t pid = struck(); pid > 0 && is_running(pid)) {
    kill(pid, case_.then);
  }
}

}  // namespace oblique::test
