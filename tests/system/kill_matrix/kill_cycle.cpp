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

constexpr std::chrono::milliseconds kBetweenLooks{5};
constexpr int kMostAttempts = 6;
constexpr int kPointsFailed = 1;  ///< exit code: the study is done and has failed points

// Has several models, so that batches end before the study does. The points of the first block take
// long enough for heartbeats and about twenty commits. A filter leaves out half of the second. The
// last two points fail.
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

bool says_end_of_study(const Process& process) {
  const std::string end = std::to_string(KillStudy::kFailing) + " of ";
  return process.err().find(end) != std::string::npos &&
         process.err().find("points failed") != std::string::npos;
}

/// The signal of a cycle. The library kill_points sends it within the target process; this class
/// prepares its environment, and later continues or kills a process that was stopped.
class Blow {
 public:
  Blow(const TemporaryFolder& folder, const KillCase& kill_case)
      : case_(kill_case),
        folder_(folder.path().string()),
        mark_(folder.file("struck")),
        library_(folder.file("kill_points.so")) {
    // LD_PRELOAD separates paths by spaces and colons, which the path of the build folder may
    // contain.
    std::filesystem::create_symlink(OBLIQUE_KILL_POINTS, library_);
    if (case_.signal == SIGSTOP) {
      halt_ = std::jthread([this](const std::stop_token& stop) { end_the_halt(stop); });
    }
  }
  Blow(const Blow&) = delete;
  Blow& operator=(const Blow&) = delete;

  /// Environment of `program`; if it is the target, with the order for kill_points.
  Environment environment(const std::string& program) const {
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
  /// Environment of a process that gets no signal. Its TMPDIR identifies all processes of a cycle,
  /// including their children.
  Environment bystander() const { return {{"TMPDIR", folder_}}; }

  bool has_struck() const { return struck() > 0; }
  /// Whether this exit code of this program was caused by the signal. True only once, because a
  /// single process gets it.
  bool explains(const std::string& program, int exit_code) {
    if (explained_ || program != case_.program || exit_code != -SIGKILL || !case_.is_killed() ||
        !has_struck()) {
      return false;
    }
    explained_ = true;
    return true;
  }

 private:
  /// The process that got the signal; −1: none yet.
  pid_t struck() const {
    std::ifstream mark(mark_);
    pid_t pid = -1;
    return mark >> pid ? pid : -1;
  }
  void end_the_halt(const std::stop_token& stop) const {
    while (!stop.stop_requested() && !has_struck()) {
      std::this_thread::sleep_for(kBetweenLooks);
    }
    const auto until = std::chrono::steady_clock::now() + case_.stopped;
    while (!stop.stop_requested() && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(kBetweenLooks);
    }
    if (const pid_t pid = struck(); pid > 0 && is_running(pid)) {
      kill(pid, case_.then);
    }
  }

  const KillCase& case_;
  std::string folder_;
  std::string mark_;
  std::string library_;
  bool explained_ = false;
  std::jthread halt_;  ///< last, as it uses the others
};

// ---- Server, workers and client, each started apart ---------------------------------------------

class ApartCycle {
 public:
  ApartCycle(const TemporaryFolder& folder, const KillStudy& study, const KillCase& kill_case,
             Blow& blow)
      : folder_(folder),
        study_(study),
        case_(kill_case),
        blow_(blow),
        database_(folder.file("matrix.db")) {}

  void run() {
    start_server();
    if (case_.storm) {
      storm_.emplace(*case_.storm, folder_, server_->worker_url(), blow_.bystander());
    }
    for (auto& worker : workers_) {
      start_worker(worker, &worker == workers_.data());
    }
    for (int attempt = 1; !submit_and_watch(attempt == 1); ++attempt) {
      if (attempt == kMostAttempts) {
        fail("the study was submitted " + std::to_string(attempt) + " times and did not end");
      }
    }
    wait_until("the study is done", [this] {
      look_after();
      return Database(database_).texts("SELECT state FROM studies").at(0) == "done";
    });
    if (storm_) {
      storm_->end();
    }
    stop_all();
  }

  bool had_storm() const { return storm_ && storm_->blows() > 0; }

 private:
  /// A server that is killed before it is ready is started again, at other ports.
  void start_server() {
    try {
      server_ = std::make_unique<Server>(folder_, database_, blow_.environment("oblique-server"));
    } catch (const std::runtime_error&) {
      if (!blow_.explains("oblique-server", -SIGKILL)) {
        throw;
      }
      server_ = std::make_unique<Server>(folder_, database_, blow_.bystander());
    }
  }

  /// Starts the server again at the same ports.
  void start_server_again() {
    server_ = std::make_unique<Server>(folder_, database_, *server_, blow_.bystander());
  }

  /// One thread each, because several cycles share the cores.
  void start_worker(std::unique_ptr<Worker>& worker, bool first) {
    worker = std::make_unique<Worker>(
        folder_, server_->worker_url(), std::vector<std::string>{"--threads", "1"},
        first ? blow_.environment("oblique-worker") : blow_.bystander());
  }

  /// Restarts the process that the signal ended. No other process may have ended.
  void look_after() {
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
    if (!blow_.explains(program, code)) {
      fail(program + " ended with exit code " + std::to_string(code) + ":\n" + process.err());
    }
  }

  /// False if the client must be started again.
  bool submit_and_watch(bool first) {
    // A client sends its request again to the restarted server and does not give up.
    Process client(
        folder_, client_program(),
        {"submit", study_.file(), "--server", server_->client_url(), "--watch", "--timeout", "600"},
        first ? blow_.environment("oblique") : blow_.bystander());
    while (!client.exit_code()) {
      look_after();
      std::this_thread::sleep_for(kBetweenLooks);
    }
    const int code = *client.exit_code();
    if (code == kPointsFailed && says_end_of_study(client)) {
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
    // Before a program reports that it has begun, a signal may end it with any exit code.
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
  Blow& blow_;
  std::string database_;
  std::unique_ptr<Server> server_;
  std::array<std::unique_ptr<Worker>, 2> workers_;
  std::optional<Storm> storm_;
};

// ---- `oblique run` ------------------------------------------------------------------------------

/// False if the same command must be run again.
bool run_once(const TemporaryFolder& folder, const KillStudy& study, const KillCase& kill_case,
              Blow& blow, bool first) {
  Process run(folder, client_program(),
              {"run", study.file(), "--db", folder.file("matrix.db"), "--workers", "2"},
              first ? blow.environment(kill_case.program) : blow.bystander());
  const int code = run.wait();
  wait_until("the children of oblique run are gone", [&] { return processes_of(folder).empty(); });
  if (code == kPointsFailed && says_end_of_study(run)) {
    return true;
  }
  // `oblique run` continues without one of its workers, but reports an error if it loses its
  // server.
  const bool server_lost = code == 1 && kill_case.program == "oblique-server" &&
                           run.err().find("was killed by signal 9") != std::string::npos;
  if (!first || !blow.has_struck() || !(server_lost || blow.explains("oblique", code))) {
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

std::string last_words(const TemporaryFolder& folder) {
  std::ostringstream words;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    if (entry.path().extension() == ".err") {
      std::ifstream file(entry.path());
      const std::string text(std::istreambuf_iterator<char>(file), {});
      constexpr std::size_t kMost = 3000;
      words << "\n--- " << entry.path().filename().string() << "\n"
            << text.substr(text.size() - std::min(kMost, text.size()));
    }
  }
  return words.str();
}

// ---- Many cycles -------------------------------------------------------------------------------

constexpr unsigned kAtOncePerCore = 4;

struct CycleOutcome {
  bool struck = false;                 ///< the point was reached
  std::optional<std::string> failure;  ///< what was wrong, with the output of the processes
};

/// Runs the study in its own folder, disturbed as the case says, until it is done. Then compares
/// the stored rows with those of the undisturbed database.
CycleOutcome run_cycle(const KillStudy& study, const KillCase& kill_case) {
  const TemporaryFolder folder;
  CycleOutcome outcome;
  Blow blow(folder, kill_case);
  try {
    if (kill_case.all_in_one) {
      if (!run_once(folder, study, kill_case, blow, true)) {
        run_once(folder, study, kill_case, blow, false);
      }
    } else {
      ApartCycle cycle(folder, study, kill_case, blow);
      cycle.run();
      outcome.struck = cycle.had_storm();
    }
    wait_until("no process is left", [&] { return processes_of(folder).empty(); });
    check_database(folder, study);
  } catch (const std::exception& error) {
    outcome.failure = error.what() + last_words(folder);
    for (const pid_t left : processes_of(folder)) {
      kill(left, SIGKILL);
    }
  }
  outcome.struck = outcome.struck || blow.has_struck();
  return outcome;
}

// ---- Rows that must be the same ----------------------------------------------------------------

struct Table {
  std::string name;
  std::set<std::string> by_chance;  ///< columns
  std::string joined;
  std::string order;
};

std::vector<Table> tables() {
  return {
      {"studies",
       {"created_at", "changed_at", "checksum", "submitted_by", "counted"},
       "",
       "study_id"},
      {"models", {"model_id"}, "", "definition"},
      // Model numbers depend on the order of arrival, so rows show the definition of the model
      // instead.
      {"results",
       {"model_id", "wall_s", "worker_id", "attempt", "solved_at", "checksum"},
       " JOIN models USING (model_id)",
       "study_id, point"},
  };
}

/// Every row as one text. The names of the columns are read from the database, so that new columns
/// are compared, too.
std::vector<std::string> rows_of(const Database& database, const Table& table) {
  // quote() writes numbers with all digits.
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
  Blow blow(folder, nobody);
  ApartCycle(folder, *this, nobody, blow).run();
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
      report.not_struck += outcome.struck ? 0 : 1;
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
