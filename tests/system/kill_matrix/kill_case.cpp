#include "tests/system/kill_matrix/kill_cycle.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <random>
#include <sstream>

namespace oblique::test {
namespace {

using std::chrono::milliseconds;

struct Entry {
  bool all_in_one;
  const char* program;
  const char* point;
  int signal;
  int highest;  ///< largest random value of KillCase::occurrence
};

constexpr bool kApart = false;
constexpr bool kRun = true;
constexpr const char* kClient = "oblique";
constexpr const char* kServer = "oblique-server";
constexpr const char* kWorker = "oblique-worker";
constexpr const char* kNoProcess = "";
constexpr int kNoSignal = 0;

// Names of storms. An entry with a storm contains one of these names as `point`.
constexpr const char* kKilledWorkers = "storm:killed workers";
constexpr const char* kCutConnections = "storm:cut connections";
constexpr const char* kVanishingPeers = "storm:vanishing peers";

// The first 23 entries run in every test run. They contain every class of point, both signals, and
// every program, started separately and by `oblique run`. A run without a signal usually reaches
// the point of an entry at least `highest` times.
constexpr std::array kMatrix{
    Entry{kApart, kServer, "before-commit", SIGKILL, 8},
    Entry{kApart, kServer, "after-commit", SIGKILL, 8},
    Entry{kApart, kServer, "before-send:results_stored", SIGKILL, 3},
    Entry{kApart, kServer, "after-send:results_stored", SIGSTOP, 3},
    Entry{kApart, kServer, "time", SIGKILL, 1500},
    Entry{kApart, kServer, "after-commit", SIGSTOP, 8},
    Entry{kApart, kServer, "after-receive:results", SIGKILL, 6},
    Entry{kApart, kWorker, "before-send:results", SIGKILL, 4},
    Entry{kApart, kWorker, "after-send:results", SIGSTOP, 4},
    Entry{kApart, kWorker, "after-receive:batch", SIGKILL, 4},
    Entry{kApart, kWorker, "after-receive:results_stored", SIGKILL, 2},
    Entry{kApart, kWorker, "time", SIGSTOP, 1200},
    Entry{kApart, kWorker, "before-send:goodbye", SIGKILL, 1},
    Entry{kApart, kClient, "after-send:submit", SIGKILL, 1},
    Entry{kApart, kClient, "before-send:submit", SIGSTOP, 1},
    Entry{kApart, kClient, "time", SIGKILL, 800},
    Entry{kRun, kClient, "time", SIGKILL, 800},
    Entry{kRun, kServer, "after-commit", SIGKILL, 8},
    Entry{kRun, kWorker, "before-send:results", SIGSTOP, 4},
    Entry{kRun, kClient, "after-receive:status", SIGSTOP, 12},
    Entry{kApart, kNoProcess, kKilledWorkers, kNoSignal, 1},
    Entry{kApart, kNoProcess, kCutConnections, kNoSignal, 1},
    Entry{kApart, kNoProcess, kVanishingPeers, kNoSignal, 1},
    // Server.
    Entry{kApart, kServer, "before-commit", SIGSTOP, 8},
    Entry{kApart, kServer, "time", SIGSTOP, 1500},
    Entry{kApart, kServer, "after-receive:submit", SIGKILL, 1},
    Entry{kApart, kServer, "before-send:submit", SIGKILL, 1},
    Entry{kApart, kServer, "after-send:submit", SIGKILL, 1},
    Entry{kApart, kServer, "after-receive:hello", SIGKILL, 2},
    Entry{kApart, kServer, "before-send:welcome", SIGKILL, 2},
    Entry{kApart, kServer, "after-send:welcome", SIGSTOP, 2},
    Entry{kApart, kServer, "before-send:study", SIGKILL, 2},
    Entry{kApart, kServer, "before-send:batch", SIGSTOP, 6},
    Entry{kApart, kServer, "after-send:batch", SIGKILL, 6},
    Entry{kApart, kServer, "after-receive:credit", SIGKILL, 6},
    Entry{kApart, kServer, "before-send:heartbeat_reply", SIGKILL, 2},
    Entry{kApart, kServer, "after-receive:goodbye", SIGKILL, 2},
    Entry{kApart, kServer, "before-send:stopping", SIGKILL, 2},
    Entry{kApart, kServer, "after-send:stopping", SIGSTOP, 2},
    // Worker.
    Entry{kApart, kWorker, "time", SIGKILL, 1200},
    Entry{kApart, kWorker, "before-send:hello", SIGKILL, 1},
    Entry{kApart, kWorker, "after-send:hello", SIGSTOP, 1},
    Entry{kApart, kWorker, "after-receive:welcome", SIGKILL, 1},
    Entry{kApart, kWorker, "after-receive:study", SIGKILL, 1},
    Entry{kApart, kWorker, "after-send:credit", SIGKILL, 4},
    Entry{kApart, kWorker, "after-receive:batch", SIGSTOP, 4},
    Entry{kApart, kWorker, "before-send:results", SIGSTOP, 4},
    Entry{kApart, kWorker, "after-send:results", SIGKILL, 4},
    Entry{kApart, kWorker, "after-receive:results_stored", SIGSTOP, 2},
    Entry{kApart, kWorker, "before-send:heartbeat", SIGKILL, 1},
    Entry{kApart, kWorker, "after-send:goodbye", SIGSTOP, 1},
    // Client.
    Entry{kApart, kClient, "before-send:submit", SIGKILL, 1},
    Entry{kApart, kClient, "after-send:submit", SIGSTOP, 1},
    Entry{kApart, kClient, "after-receive:submit", SIGKILL, 1},
    Entry{kApart, kClient, "before-send:status", SIGKILL, 12},
    Entry{kApart, kClient, "after-send:status", SIGSTOP, 12},
    Entry{kApart, kClient, "time", SIGSTOP, 800},
    // Signals to `oblique run` and its children. The first signal arrives while they start.
    Entry{kRun, kClient, "time", SIGKILL, 40},
    Entry{kRun, kClient, "time", SIGSTOP, 800},
    Entry{kRun, kClient, "before-send:submit", SIGKILL, 1},
    Entry{kRun, kClient, "after-send:submit", SIGKILL, 1},
    Entry{kRun, kClient, "after-receive:submit", SIGSTOP, 1},
    Entry{kRun, kClient, "before-send:query", SIGKILL, 1},
    Entry{kRun, kServer, "time", SIGKILL, 1000},
    Entry{kRun, kServer, "before-commit", SIGKILL, 8},
    Entry{kRun, kServer, "after-commit", SIGSTOP, 8},
    Entry{kRun, kServer, "after-send:results_stored", SIGKILL, 3},
    Entry{kRun, kServer, "after-receive:query", SIGSTOP, 1},
    Entry{kRun, kServer, "before-send:submit", SIGKILL, 1},
    Entry{kRun, kServer, "after-receive:goodbye", SIGSTOP, 1},
    Entry{kRun, kWorker, "time", SIGKILL, 800},
    Entry{kRun, kWorker, "after-send:results", SIGKILL, 4},
    Entry{kRun, kWorker, "after-receive:results_stored", SIGSTOP, 2},
    Entry{kRun, kWorker, "before-send:goodbye", SIGSTOP, 1},
};

std::string name_of(int signal) {
  return signal == SIGKILL ? "SIGKILL" : signal == SIGSTOP ? "SIGSTOP" : "SIGCONT";
}

std::optional<StormKind> storm_of(const std::string& point) {
  if (point == kKilledWorkers) {
    return StormKind::kKilledWorkers;
  }
  if (point == kCutConnections) {
    return StormKind::kCutConnections;
  }
  return point == kVanishingPeers ? std::optional(StormKind::kVanishingPeers) : std::nullopt;
}

}  // namespace

bool KillCase::is_killed() const {
  return signal == SIGKILL || then == SIGKILL;
}

std::uint64_t entries_of_matrix() {
  return kMatrix.size();
}

KillCase draw_case(std::uint64_t seed) {
  const Entry& entry = kMatrix.at(seed % kMatrix.size());
  std::mt19937_64 random(seed);
  const auto up_to = [&random](int highest) {
    return 1 + static_cast<int>(random() % static_cast<std::uint64_t>(highest));
  };
  KillCase drawn;
  drawn.seed = seed;
  drawn.all_in_one = entry.all_in_one;
  drawn.program = entry.program;
  drawn.point = entry.point;
  drawn.storm = storm_of(drawn.point);
  drawn.signal = entry.signal;
  drawn.occurrence = up_to(entry.highest);
  // Without a pause the signal precedes the message. A pause of 20 ms lets the message be sent
  // first.
  drawn.pause = milliseconds(random() % 2 == 0 ? 0 : 20);
  drawn.server_stops_first = random() % 2 == 0;
  if (drawn.signal == SIGSTOP) {
    // Server and workers regard each other as lost after 3 s without messages; requests of a client
    // time out after 10 s.
    constexpr std::array kStopped{milliseconds(300), milliseconds(1500), milliseconds(4500)};
    drawn.stopped = kStopped.at(random() % kStopped.size());
    drawn.then = random() % 3 == 0 ? SIGKILL : SIGCONT;
  }
  // A worker sends `goodbye` only to a running server; a server sends `stopping` only to running
  // workers.
  if (drawn.point.ends_with(":goodbye")) {
    drawn.server_stops_first = false;
  } else if (drawn.point.ends_with(":stopping")) {
    drawn.server_stops_first = true;
  }
  return drawn;
}

std::string class_of(const std::string& point) {
  return point.substr(0, point.find(':'));
}

std::string describe(const KillCase& kill_case) {
  std::ostringstream line;
  line << "seed " << kill_case.seed << ": ";
  if (kill_case.storm) {
    line << kill_case.point;
    return line.str();
  }
  line << (kill_case.all_in_one ? "oblique run, " : "") << kill_case.program << " at "
       << kill_case.point << " " << kill_case.occurrence
       << (kill_case.point == "time" ? " ms" : "");
  if (kill_case.pause.count() > 0) {
    line << " + " << kill_case.pause.count() << " ms";
  }
  line << ", " << name_of(kill_case.signal);
  if (kill_case.signal == SIGSTOP) {
    line << " for " << kill_case.stopped.count() << " ms, then " << name_of(kill_case.then);
  }
  if (!kill_case.all_in_one) {
    line << ", at the end stopped first: " << (kill_case.server_stops_first ? "server" : "workers");
  }
  return line.str();
}

}  // namespace oblique::test
