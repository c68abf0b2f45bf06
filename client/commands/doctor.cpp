#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/io/child_process.h"
#include "client/io/console.h"
#include "client/service/connection.h"
#include "client/service/source.h"
#include "proto/keys/key_file.h"
#include "proto/program/origin/origin.h"
#include "proto/system/resources.h"
#include "proto/text.h"
#include "server/database/database_file.h"
#include "server/database/sqlite.h"
#include "server/store/schema.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

constexpr const char* kDoctorExamples = R"(Examples:
  oblique doctor
  oblique doctor > doctor.txt                  for a defect report
  oblique doctor --db friction.db
  oblique doctor --server tcp://hub:7600 --keys client.key

Checks versions, processor, speed of the solver, the database and its disk, the key file and the
server. Each line begins with ok, warning or error; warnings and errors include the remedy. Nothing
is written or changed. Exit code 1 if there is an error: the server does not answer or refuses the
key, or the database cannot be read. `oblique check` searches a database for damage.)";

struct DoctorFlags {
  std::string database;  // empty if not given
  SourceFlags source;
};

/// Collects findings. Prints each finding at once, on its own line.
class Diagnosis {
 public:
  explicit Diagnosis(std::ostream& out) : out_(out) {}

  void ok(std::string_view check, const std::string& text) { print("ok", check, text); }
  void warning(std::string_view check, const std::string& text) { print("warning", check, text); }
  void error(std::string_view check, const std::string& text) {
    print("error", check, text);
    has_error_ = true;
  }
  bool has_error() const { return has_error_; }

 private:
  void print(std::string_view state, std::string_view check, const std::string& text) {
    out_ << fmt::format("{:<7}  {:<9}  {}\n", state, check, protocol::visible(text)) << std::flush;
  }

  std::ostream& out_;
  bool has_error_ = false;
};

void check_program_beside(Diagnosis& diagnosis, const std::string& name) {
  constexpr const char* kCheck = "versions";
  try {
    const auto program = sibling_program(name);
    std::string line = output_of({.program = program, .arguments = {"--version"}});
    line.resize(std::min(line.find('\n'), line.size()));
    if (line == fmt::format("{} {}", name, protocol::version_and_commit())) {
      diagnosis.ok(kCheck, name + " is of the same build");
    } else {
      diagnosis.warning(
          kCheck,
          fmt::format(
              "{} and this program are of different builds: install all programs of one version",
              line));
    }
  } catch (const ProcessError& error) {
    diagnosis.warning(
        kCheck, fmt::format("`oblique run` and `oblique view` do not work: {}", error.what()));
  }
}

void check_versions(Diagnosis& diagnosis) {
  const auto origin = protocol::origin();
  diagnosis.ok("versions", fmt::format("oblique {}, built with {}, {}; SQLite {}",
                                       protocol::version_and_commit(), origin.compiler,
                                       origin.build_type, sqlite3_libversion()));
  if (origin.build_type != "Release") {
    diagnosis.warning(
        "versions",
        "a program that is not built as Release is slow: build it with -DCMAKE_BUILD_TYPE=Release");
  }
  for (const char* name : {"oblique-server", "oblique-worker"}) {
    check_program_beside(diagnosis, name);
  }
}

std::string processor_name() {
  std::ifstream lines("/proc/cpuinfo");
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("model name") && line.find(": ") != std::string::npos) {
      return line.substr(line.find(": ") + 2);
    }
  }
  return "unknown processor";
}

void check_processor(Diagnosis& diagnosis) {
  const std::string set = solver::instruction_set();
  const auto usable = protocol::usable_processors();
  diagnosis.ok("processor",
               fmt::format("{}; {} of {} threads may be used{}{}; the solver uses {}",
                           processor_name(), usable.count, sysconf(_SC_NPROCESSORS_ONLN),
                           usable.reason.empty() ? "" : ": ", usable.reason, set));
  if (set != "avx512" && set != "avx2") {
    diagnosis.warning("processor",
                      "the solver is more than twice as fast with AVX2: give the virtual machine "
                      "the processor type of its host");
  }
}

/// Processor time of this thread [s]; other programs do not affect it.
double cpu_time_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  constexpr double kNano = 1e-9;
  return static_cast<double>(time.tv_sec) + kNano * static_cast<double>(time.tv_nsec);
}

/// Measures the processor time [s] per point of the preset `paper`, without the fall. Points are
/// solved together in vector lanes.
double measured_point_s() {
  constexpr std::uint64_t kPoints = 600;
  const solver::Finger finger(solver::preset("paper"));
  (void)finger.solve(1.0, 0.4, 1.0);  // solves the fall in advance
  std::vector<solver::Point> points;
  for (std::uint64_t i = 0; i < kPoints; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(kPoints);
    points.push_back({1.0, 0.1 + 1.9 * part, 1.0 - 0.5 * part});
  }
  const double start_s = cpu_time_s();
  for (const solver::Outcome& outcome : solver::solve_points(finger, points)) {
    if (!outcome.result) {
      throw std::runtime_error("a point of the preset `paper` fails: " + outcome.error);
    }
  }
  return (cpu_time_s() - start_s) / static_cast<double>(kPoints);
}

void check_solver(Diagnosis& diagnosis) {
  const std::string set = solver::instruction_set();
  // Reference times, measured on processors of 2023; see tests/bench/README.md.
  const double reference_s = set == "avx512" ? 0.07e-3 : set == "avx2" ? 0.12e-3 : 0.30e-3;
  constexpr double kSlow = 3.0;
  const double point_s = measured_point_s();
  const auto text =
      fmt::format("{:.3f} ms of processor time per point; reference for {}: {:.2f} ms",
                  1e3 * point_s, set, 1e3 * reference_s);
  if (point_s > kSlow * reference_s) {
    diagnosis.warning("solver", text +
                                    ": the processor is old, throttled or shared with other "
                                    "virtual machines, or this is not a Release build");
  } else {
    diagnosis.ok("solver", text);
  }
}

/// Checks the disk of the database `file`, which may be missing. False if its folder is missing.
bool check_disk(Diagnosis& diagnosis, const std::string& file) {
  constexpr const char* kCheck = "disk";
  std::error_code error;
  const auto path = std::filesystem::weakly_canonical(std::filesystem::absolute(file), error);
  const auto folder = path.parent_path();
  const auto space = std::filesystem::space(folder, error);
  if (error) {
    diagnosis.error(kCheck, fmt::format("there is no folder {}: create it, or name another --db",
                                        folder.string()));
    return false;
  }
  constexpr std::uint64_t kLittleSpace = 500'000'000;
  const bool exists = std::filesystem::exists(path, error);
  if (access(folder.c_str(), W_OK) != 0 || (exists && access(path.c_str(), W_OK) != 0)) {
    diagnosis.warning(
        kCheck,
        fmt::format("this user cannot write to {}: name a --db in another folder to solve a study",
                    exists ? path.string() : folder.string()));
  } else if (space.available < kLittleSpace) {
    diagnosis.warning(kCheck, fmt::format("{} has only {} free: a million results take about 650 "
                                          "MB; studies wait while the disk is full",
                                          folder.string(), format_bytes(space.available)));
  } else {
    diagnosis.ok(kCheck, fmt::format("{} is writable and has {} free", folder.string(),
                                     format_bytes(space.available)));
  }
  if (const auto objection = server::network_disk_error(path.string()); !objection.empty()) {
    diagnosis.warning(kCheck, objection);
  }
  return true;
}

void check_database(Diagnosis& diagnosis, const std::string& named_file) {
  constexpr const char* kCheck = "database";
  const std::string file = named_file.empty() ? DatabaseSettings().file : named_file;
  if (!check_disk(diagnosis, file)) {
    return;
  }
  if (std::error_code error; !std::filesystem::exists(file, error)) {
    const auto text = fmt::format("there is no database {}", file);
    named_file.empty() ? diagnosis.ok(kCheck, text + " yet; `oblique run` creates it")
                       : diagnosis.error(kCheck, text + ": correct --db");
    return;
  }
  try {
    const auto database = server::open_for_reading(file);
    if (server::identify(database.get(), file) == server::DatabaseKind::kEmpty) {
      diagnosis.ok(kCheck, file + " is empty");
      return;
    }
    const auto sound = server::open_with_schema(file);
    server::Statement studies(sound.get(), "SELECT count(*) FROM studies");
    studies.step();
    diagnosis.ok(
        kCheck,
        fmt::format("{}: schema {}, {}, {}", file, server::kSchemaVersion,
                    counted(static_cast<std::uint64_t>(studies.integer(0)), "study", "studies"),
                    server::is_in_use(file) ? "in use by a server" : "not in use by a server"));
  } catch (const server::StorageError& error) {
    diagnosis.error(kCheck, error.what());
  }
}

/// Returns false if the flags name a key file that cannot be used.
bool check_key(Diagnosis& diagnosis, const DoctorFlags& flags) {
  const std::string file = flags.source.keys.empty()
                               ? environment_variable("OBLIQUE_KEYS").value_or("")
                               : flags.source.keys;
  if (file.empty()) {
    diagnosis.ok("key", "no key file; a server with keys needs --keys or OBLIQUE_KEYS");
    return true;
  }
  try {
    const auto key = protocol::read_key_file(file);
    diagnosis.ok(
        "key", fmt::format("{} holds the {} key {}", file, protocol::name_of(key.role), key.name));
    return true;
  } catch (const std::exception& error) {
    diagnosis.error("key", error.what());
    return false;
  }
}

void check_server(Diagnosis& diagnosis, const DoctorFlags& flags, Console& console) {
  constexpr const char* kCheck = "server";
  if (flags.source.server.empty() && environment_variable("OBLIQUE_SERVER").value_or("").empty()) {
    diagnosis.ok(kCheck, "not checked; name one with --server URL or OBLIQUE_SERVER");
    return;
  }
  try {
    Connection connection(connection_settings(console, flags.source));
    const auto status = connection.full_status();
    diagnosis.ok(kCheck,
                 fmt::format("{} answers{}: oblique-server {}, {} workers", connection.url(),
                             status.access() == "keys" ? " and admits the key" : "",
                             status.version(), format_count(status.workers())));
    if (status.version() != protocol::version_and_commit()) {
      diagnosis.warning(kCheck,
                        fmt::format("this program is {}: install one version on both machines",
                                    protocol::version_and_commit()));
    }
    if (status.access() == "insecure") {
      diagnosis.warning(kCheck,
                        "anyone who can reach the server may use it (--insecure): create keys with "
                        "`oblique keygen`");
    }
    if (status.draining()) {
      diagnosis.warning(kCheck,
                        "the server is shutting down: studies continue when it is started again");
    } else if (status.workers() == 0) {
      diagnosis.warning(kCheck, "studies wait for a worker: start oblique-worker");
    }
  } catch (const std::exception& error) {
    diagnosis.error(kCheck, error.what());
  }
}

int diagnose(const DoctorFlags& flags, Console& console) {
  Diagnosis diagnosis(console.out());
  check_versions(diagnosis);
  check_processor(diagnosis);
  check_solver(diagnosis);
  check_database(diagnosis, flags.database);
  if (check_key(diagnosis, flags)) {
    check_server(diagnosis, flags, console);
  }
  return diagnosis.has_error() ? kFailed : kDone;
}

}  // namespace

void add_doctor(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "doctor", "Check programs, processor, database, key and server",
                  kDoctorExamples, diagnose);
  command
      .add_option("--db", flags.database,
                  fmt::format("database to check; default: {}", DatabaseSettings().file))
      ->type_name("FILE");
  add_server_flags(command, flags.source);
  command.get_option("--server")
      ->description("server to check; default: OBLIQUE_SERVER, else none");
}

}  // namespace oblique::client
