#include "tests/system/kill_matrix/kill_cycle.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/support/database.h"

namespace oblique::test {
namespace {

constexpr std::chrono::milliseconds kPollInterval{5};
constexpr int kMaxAttempts = 6;
constexpr int kPointsFailed = 1;  ///< exit code of a complete study with failed points

// A batch ends with a model if possible. So batches of this study, which has several models, also
// end in its middle. The first block takes long enough for heartbeats and about twenty commits. A
// filter leaves out half of the second block. Both points of the last block fail.
constexpr const char* kStudy = R"(name = "matrix"
[model]
preset = "paper"
[[block]]
dt = 1e-6
H = 1.0
mu = { from = 0.1, to = 2.0, count = 24 }
e = { from = 0.5, to = 1.0, count = 25 }
[[block]]
dt = [4e-6, 2e-6]
H = [0.98, 1.0]
mu = { from = 0.1, to = 2.0, count = 20 }
e = { from = 0.5, to = 1.0, count = 10 }
where = "sin(1e4 * mu) > 0"
[[block]]
dt = 2e-5
H = 1.0
mu = 0.4
e = [0.8, 1.0]
)";

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what);
}

bool reports_end_of_study(const Process& process) {
  const std::string end = std::to_string(KillStudy::kFailing) + " of ";
  return process.err().find(end) != std::string::npos &&
         process.err().find("points failed") != std::string::npos;
}

/// Injects the signal of a cycle. The library kill_points lets a process send the signal to itself.
/// This class controls the library by environment variables. It also continues or kills a halted
/// process.
class FaultInjection {
 public:
  FaultInjection(const TemporaryFolder& folder, const KillCase& kill_case)
      : case_(kill_case),
        folder_(folder.path().string()),
        mark_(folder.file("mark")),
        library_(folder.file("kill_points.so")) {
    // LD_PRELOAD separates paths at spaces and colons. The path of this link contains neither.
    std::filesystem::create_symlink(OBLIQUE_KILL_POINTS, library_);
    if (case_.signal == SIGSTOP) {
      halt_ = std::jthread([this](const std::stop_token& stop) { end_halt(stop); });
    }
  }
  FaultInjection(const FaultInjection&) = delete;
  FaultInjection& operator=(const FaultInjection&) = delete;

  /// Returns the environment of `program`. If the case names `program`, the environment contains
  /// OBLIQUE_KILL_AT, which defines the signal (kill_points.cpp).
  Environment environment(const std::string& program) const {
    Environment all = plain_environment();
    if (program == case_.program) {
      std::ostringstream order;
      order << case_.program << ' ' << case_.point << ' ' << case_.occurrence << ' ' << case_.signal
            << ' ' << case_.pause.count() << ' ' << mark_;
      all["OBLIQUE_KILL_AT"] = order.str();
      all["LD_PRELOAD"] = library_;
    }
    return all;
  }
  /// Returns the environment of processes that get no signal. All processes of a cycle inherit its
  /// TMPDIR, by which `processes_of` finds them.
  Environment plain_environment() const { return {{"TMPDIR", folder_}}; }

  bool has_happened() const { return target() > 0; }
  /// Returns true if the signal explains that `program` ended with `exit_code`. This is true at
  /// most once, because only one process gets the signal.
  bool explains(const std::string& program, int exit_code) {
    if (explained_ || program != case_.program || exit_code != -SIGKILL || !case_.is_killed() ||
        !has_happened()) {
      return false;
    }
    explained_ = true;
    return true;
  }

 private:
  /// Returns the process that got the signal, or −1 before the signal.
  pid_t target() const {
    std::ifstream mark(mark_);
    pid_t pid = -1;
    return mark >> pid ? pid : -1;
  }
  void end_halt(const std::stop_token& stop) const {
    while (!stop.stop_requested() && !has_happened()) {
      std::this_thread::sleep_for(kPollInterval);
    }
    const auto until = std::chrono::steady_clock::now() + case_.stopped;
    while (!stop.stop_requested() && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(kPollInterval);
    }
    if (const pid_t pid = target(); pid > 0 && is_running(pid)) {
      kill(pid, case_.then);
    }
  }

  const KillCase& case_;
  std::string folder_;
  std::string mark_;
  std::string library_;
  bool explained_ = false;
  std::jthread halt_;  ///< declared last, because the thread uses the other members
};

// ---- Server, workers and client as separate programs --------------------------------------------

class ApartCycle {
 public:
  ApartCycle(const TemporaryFolder& folder, const KillStudy& study, const KillCase& kill_case,
             FaultInjection& injection)
      : folder_(folder),
        study_(study),
        case_(kill_case),
        injection_(injection),
        database_(folder.file("matrix.db")) {}

  void run() {
    start_server();
    if (case_.storm) {
      storm_.emplace(*case_.storm, folder_, server_->worker_url(), injection_.plain_environment());
    }
    for (auto& worker : workers_) {
      start_worker(worker, &worker == workers_.data());
    }
    for (int attempt = 1; !submit_and_watch(attempt == 1); ++attempt) {
      if (attempt == kMaxAttempts) {
        fail("the study was submitted " + std::to_string(attempt) + " times and did not end");
      }
    }
    wait_until("the study is done", [this] {
      restart_killed();
      return Database(database_).texts("SELECT state FROM studies").at(0) == "done";
    });
    if (storm_) {
      storm_->end();
    }
    stop_all();
  }

  bool had_storm() const { return storm_ && storm_->faults() > 0; }

 private:
  /// Starts the server; if it is killed before it is ready, starts another at other ports.
  void start_server() {
    try {
      server_ =
          std::make_unique<Server>(folder_, database_, injection_.environment("oblique-server"));
    } catch (const std::runtime_error&) {
      if (!injection_.explains("oblique-server", -SIGKILL)) {
        throw;
      }
      server_ = std::make_unique<Server>(folder_, database_, injection_.plain_environment());
    }
  }

  void start_server_again() {
    server_ =
        std::make_unique<Server>(folder_, database_, *server_, injection_.plain_environment());
  }

  /// The worker has one thread, because many cycles share the cores.
  void start_worker(std::unique_ptr<Worker>& worker, bool first) {
    worker = std::make_unique<Worker>(
        folder_, server_->worker_url(), std::vector<std::string>{"--threads", "1"},
        first ? injection_.environment("oblique-worker") : injection_.plain_environment());
  }

  /// Restarts the process that the signal has ended. Fails if another process has ended.
  void restart_killed() {
    if (const auto code = server_->process().exit_code()) {
      expect_explained("oblique-server", *code, server_->process());
      start_server_again();
    }
    for (auto& worker : workers_) {
      if (const auto code = worker->exit_code()) {
        expect_explained("oblique-worker", *code, *worker);
        start_worker(worker, false);
      }
    }
  }

  void expect_explained(const std::string& program, int code, const Process& process) {
    if (!injection_.explains(program, code)) {
      fail(program + " ended with exit code " + std::to_string(code) + ":\n" + process.err());
    }
  }

  /// Runs the client. Returns false if it was killed and must be started again.
  bool submit_and_watch(bool first) {
    // With the long timeout the client can repeat requests that a killed server had received.
    Process client(
        folder_, client_program(),
        {"submit", study_.file(), "--server", server_->client_url(), "--watch", "--timeout", "600"},
        first ? injection_.environment("oblique") : injection_.plain_environment());
    while (!client.exit_code()) {
      restart_killed();
      std::this_thread::sleep_for(kPollInterval);
    }
    const int code = *client.exit_code();
    if (code == kPointsFailed && reports_end_of_study(client)) {
      return true;
    }
    expect_explained("oblique", code, client);
    return false;
  }

  void stop_all() {
    if (case_.server_stops_first) {
      stop("oblique-server", server_->process());
    }
    for (auto& worker : workers_) {
      stop("oblique-worker", *worker);
    }
    if (!case_.server_stops_first) {
      stop("oblique-server", server_->process());
    }
  }

  void stop(const std::string& program, Process& process) {
    // A program does not necessarily handle signals before its first log line.
    wait_until(program + " has begun",
               [&] { return process.exit_code() || !process.err().empty(); });
    if (!process.exit_code()) {
      process.send(SIGTERM);
    }
    if (const int code = process.wait(); code != 0) {
      expect_explained(program, code, process);
    }
  }

  const TemporaryFolder& folder_;
  const KillStudy& study_;
  const KillCase& case_;
  FaultInjection& injection_;
  std::string database_;
  std::unique_ptr<Server> server_;
  std::array<std::unique_ptr<Worker>, 2> workers_;
  std::optional<Storm> storm_;
};

// ---- `oblique run` ------------------------------------------------------------------------------

/// Runs `oblique run`. Returns false if it ended early and must be repeated.
bool run_once(const TemporaryFolder& folder, const KillStudy& study, const KillCase& kill_case,
              FaultInjection& injection, bool first) {
  Process run(folder, client_program(),
              {"run", study.file(), "--db", folder.file("matrix.db"), "--workers", "2"},
              first ? injection.environment(kill_case.program) : injection.plain_environment());
  const int code = run.wait();
  wait_until("the children of oblique run are gone", [&] { return processes_of(folder).empty(); });
  if (code == kPointsFailed && reports_end_of_study(run)) {
    return true;
  }
  // `oblique run` survives the loss of a worker, but ends if its server is killed.
  const bool server_lost = code == 1 && kill_case.program == "oblique-server" &&
                           run.err().find("was killed by signal 9") != std::string::npos;
  if (!first || !injection.has_happened() ||
      !(server_lost || injection.explains("oblique", code))) {
    fail("oblique run ended with exit code " + std::to_string(code) + ":\n" + run.err());
  }
  return false;
}

// ---- The end ------------------------------------------------------------------------------------

void check_database(const TemporaryFolder& folder, const KillStudy& study) {
  const std::string database = folder.file("matrix.db");
  const Outcome check = run_oblique(folder, {"check", "--db", database});
  if (check.exit_code != 0) {
    fail("oblique check: " + check.out + check.err);
  }
  if (Database(database).texts("SELECT state FROM studies") != std::vector<std::string>{"done"}) {
    fail("the study is not done, or not the only one");
  }
  if (const std::string difference = first_difference(database, study.undisturbed());
      !difference.empty()) {
    fail("differs from the undisturbed run: " + difference);
  }
}

std::string error_output(const TemporaryFolder& folder) {
  std::ostringstream output;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    if (entry.path().extension() == ".err") {
      std::ifstream file(entry.path());
      const std::string text(std::istreambuf_iterator<char>(file), {});
      constexpr std::size_t kMax = 3000;
      output << "\n--- " << entry.path().filename().string() << "\n"
             << text.substr(text.size() - std::min(kMax, text.size()));
    }
  }
  return output.str();
}

// ---- Many cycles --------------------------------------------------------------------------------

constexpr unsigned kAtOncePerCore = 4;

struct CycleOutcome {
  bool reached = false;                ///< the signal was sent, or a fault of the storm happened
  std::optional<std::string> failure;  ///< why the cycle failed, and the processes' standard error
};

/// Runs the study in a temporary folder with the signal of the case, and compares its database with
/// that of an undisturbed run.
CycleOutcome run_cycle(const KillStudy& study, const KillCase& kill_case) {
  const TemporaryFolder folder;
  CycleOutcome outcome;
  FaultInjection injection(folder, kill_case);
  try {
    if (kill_case.all_in_one) {
      if (!run_once(folder, study, kill_case, injection, true)) {
        run_once(folder, study, kill_case, injection, false);
      }
    } else {
      ApartCycle cycle(folder, study, kill_case, injection);
      cycle.run();
      outcome.reached = cycle.had_storm();
    }
    wait_until("no process is left", [&] { return processes_of(folder).empty(); });
    check_database(folder, study);
  } catch (const std::exception& error) {
    outcome.failure = error.what() + error_output(folder);
    for (const pid_t left : processes_of(folder)) {
      kill(left, SIGKILL);
    }
  }
  outcome.reached = outcome.reached || injection.has_happened();
  return outcome;
}

// ---- Rows that must be equal --------------------------------------------------------------------

struct Table {
  std::string name;
  std::set<std::string> by_chance;  ///< columns that are not compared
  std::string joined;
  std::string order;
};

std::vector<Table> tables() {
  return {
      {"studies",
       {"created_at", "changed_at", "checksum", "submitted_by", "counted", "uid"},
       "",
       "study_id"},
      {"models", {"model_id"}, "", "definition"},
      // The number of a model depends on the order of arrival, so its definition is compared
      // instead.
      {"results",
       {"model_id", "wall_s", "worker_id", "attempt", "solved_at", "checksum"},
       " JOIN models USING (model_id)",
       "study_id, point"},
  };
}

/// Returns every row as one text. The schema gives the columns, so new columns are compared too.
std::vector<std::string> rows_of(const Database& database, const Table& table) {
  // quote() writes numbers with all their digits.
  std::string row = table.joined.empty() ? "''" : "quote(models.definition)";
  for (const std::string& column :
       database.texts("SELECT name FROM pragma_table_info('" + table.name + "')")) {
    if (!table.by_chance.contains(column)) {
      row += " || ' " + column + "=' || quote(" + table.name + "." + column + ")";
    }
  }
  return database.texts("SELECT " + row + " FROM " + table.name + table.joined + " ORDER BY " +
                        table.order);
}

}  // namespace

KillStudy::KillStudy() {
  std::ofstream(file()) << kStudy;
  const TemporaryFolder folder;
  const KillCase nobody;
  FaultInjection injection(folder, nobody);
  ApartCycle(folder, *this, nobody, injection).run();
  std::filesystem::copy_file(folder.file("matrix.db"), undisturbed());
}

MatrixReport run_matrix(std::uint64_t first_seed, std::uint64_t count) {
  const KillStudy study;
  MatrixReport report;
  std::mutex mutex;
  std::atomic<std::uint64_t> next = first_seed;
  const auto work = [&] {
    for (std::uint64_t seed = next++; seed < first_seed + count; seed = next++) {
      const KillCase kill_case = draw_case(seed);
      const CycleOutcome outcome = run_cycle(study, kill_case);
      const std::lock_guard lock(mutex);
      ++report.cycles;
      report.not_reached += outcome.reached ? 0 : 1;
      if (outcome.failure) {
        report.failures.push_back(describe(kill_case) + ": " + *outcome.failure);
      }
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 0; i < kAtOncePerCore * std::max(1U, std::thread::hardware_concurrency());
       ++i) {
    threads.emplace_back(work);
  }
  threads.clear();
  return report;
}

std::string first_difference(const std::string& database, const std::string& other) {
  for (const Table& table : tables()) {
    const auto rows = rows_of(Database(database), table);
    const auto others = rows_of(Database(other), table);
    const std::size_t both = std::min(rows.size(), others.size());
    for (std::size_t i = 0; i < both; ++i) {
      if (rows[i] != others[i]) {
        return table.name + ", row " + std::to_string(i) + ":\n" + rows[i] + "\n" + others[i];
      }
    }
    if (rows.size() != others.size()) {
      return table.name + ": " + std::to_string(rows.size()) + " rows and " +
             std::to_string(others.size());
    }
  }
  return {};
}

}  // namespace oblique::test
