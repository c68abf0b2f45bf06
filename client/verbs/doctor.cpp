#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/service/source.h"
#include "client/verbs/doctor/examination.h"
#include "client/verbs/doctor/machine.h"
#include "client/verbs/doctor/places.h"
#include "client/verbs/doctor/programs.h"
#include "client/verbs/doctor/server_reach.h"
#include "client/verbs/doctor/settings.h"
#include "client/verbs/doctor/solving_time.h"
#include "client/verbs/verbs.h"
#include "proto/program/usage.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kDoctorExamples = R"(Examples:
  oblique doctor
  oblique doctor > doctor.txt                  for a defect report: look at it first
  oblique doctor --db friction.db --json
  oblique doctor --server tcp://hub:7600 --keys client.key

Says what this machine has, what works and what is odd, within some 2 s; it writes no file and
changes nothing. The home folder is shown as ~, the machine's name and all keys are left out.
Exit code 1 where something cannot work: a server that does not answer, a key that is refused, a
database that cannot be read. A database is not searched for damage: `oblique check` does that.)";

struct DoctorFlags {
  std::string database;  // empty: not given
  std::string server;    // empty: not given
  std::string keys;      // empty: not given
  bool json = false;
  bool with_host_name = false;
  bool leaves_out_timing = false;
  double timeout_s = 1.8;
};

doctor::Findings silence(const std::string& key, const std::string& what) {
  doctor::Findings findings{key, key};
  findings.broken.push_back(fmt::format(
      "{} did not answer within the time of this look: it hangs, or the machine has much to do. "
      "Give it more with --timeout SECONDS.",
      what));
  return findings;
}

/// All parts at once, so that none waits for another.
doctor::Report examined(const DoctorFlags& flags, bool& has_silent_part) {
  // Parts that end by themselves do so before it is said that they hang.
  constexpr double kOfTheirOwn = 0.8;
  const auto start = Clock::now();
  const auto after = [start](double seconds) {
    return start +
           std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  };
  const auto end = after(flags.timeout_s);
  const auto own_end = after(kOfTheirOwn * flags.timeout_s);
  const std::string database = flags.database.empty() ? DatabaseSettings().file : flags.database;
  const bool is_named = !flags.database.empty();
  const doctor::ServerMeant server{
      flags.server.empty() ? doctor::variable("OBLIQUE_SERVER") : flags.server,
      flags.keys.empty() ? doctor::variable("OBLIQUE_KEYS") : flags.keys};

  std::vector<doctor::Examination> parts;
  parts.emplace_back(silence("programs", "A program beside this one"),
                     [own_end] { return doctor::examine_programs(own_end); });
  parts.emplace_back(silence("machine", "The system"),
                     [&flags] { return doctor::examine_machine(flags.with_host_name); });
  if (!flags.leaves_out_timing) {
    parts.emplace_back(silence("solver", "The solver"), doctor::examine_solver);
  }
  parts.emplace_back(silence("disk", "The disk of the database"),
                     [database] { return doctor::examine_disk(database); });
  if (is_named || std::filesystem::exists(database)) {
    parts.emplace_back(silence("database", "The database"), [database, is_named] {
      return doctor::examine_database(database, is_named);
    });
  }
  if (!server.url.empty()) {
    parts.emplace_back(
        silence("server", fmt::format("The server {}, or who knows its address,", server.url)),
        [server, own_end] { return doctor::examine_server(server, own_end); });
  }
  parts.emplace_back(silence("settings", "A key file's disk"),
                     [keys = flags.keys] { return doctor::examine_settings(keys); });
  doctor::Report report;
  for (auto& part : parts) {
    report.push_back(part.findings(end));
    has_silent_part = has_silent_part || part.is_silent();
  }
  return report;
}

int diagnose(const DoctorFlags& flags) {
  bool has_silent_part = false;
  const auto report = examined(flags, has_silent_part);
  if (flags.json) {
    std::cout << doctor::json_of(report).dump(2, ' ', false,
                                              nlohmann::json::error_handler_t::replace)
              << '\n';
  } else {
    constexpr std::size_t kUsualWidth = 80;
    doctor::print(std::cout, report, kUsualWidth);
  }
  const int code = doctor::is_anything_broken(report) ? kFailed : kDone;
  if (has_silent_part) {  // its thread hangs in the system, and nobody can end it
    std::cout.flush();
    std::_Exit(code);
  }
  return code;
}

}  // namespace

void add_doctor(CLI::App& app, Command& command) {
  auto flags = std::make_shared<DoctorFlags>();
  auto* verb = app.add_subcommand("doctor", "Say what this machine has and what is odd");
  verb->footer(kDoctorExamples);
  verb->add_option("--db", flags->database,
                   fmt::format("database to look at; default: {} when it is in this folder",
                               DatabaseSettings().file))
      ->type_name("FILE");
  verb->add_option("--server", flags->server,
                   "address of a server to ask; default: OBLIQUE_SERVER, else none")
      ->type_name("URL");
  verb->add_option("--keys", flags->keys,
                   "key file for a server that has keys; default: OBLIQUE_KEYS, else none")
      ->type_name("FILE");
  constexpr double kShortest_s = 0.1;
  constexpr double kLongest_s = 3600.0;
  verb->add_option("--timeout", flags->timeout_s, "longest wait for all of it [s]")
      ->type_name("SECONDS")
      ->capture_default_str()
      ->check(protocol::number_between(kShortest_s, kLongest_s));
  verb->add_flag("--json", flags->json, "print one JSON object");
  verb->add_flag("--no-timing", flags->leaves_out_timing,
                 "solve nothing: leave out how long a case takes");
  verb->add_flag("--host-name", flags->with_host_name, "say the name of this machine too");
  verb->callback([flags, &command] { command = [flags] { return diagnose(*flags); }; });
}

}  // namespace oblique::client
