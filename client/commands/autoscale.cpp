#include "client/commands/autoscale.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/io/child_process.h"
#include "client/io/console.h"
#include "client/service/connection.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"
#include "proto/result_message.h"
#include "proto/small_file.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kAutoscaleExamples = R"(Examples:
  oblique autoscale slurm --max 10 --script oblique-workers.sbatch
  oblique autoscale slurm --min 1 --max 20 --sbatch-args "--partition=short -A lab7"
  oblique autoscale slurm --max 10 --points-per-job 500    for slow points
  oblique autoscale slurm --max 10 --dry-run               print what would be submitted now
  oblique autoscale slurm --max 10 --once                  one round, for cron
Set these first, for the workers in the jobs:
  export OBLIQUE_WORKER_SERVER=tcp://head:7601 OBLIQUE_WORKER_KEYS=~/oblique/worker.key

In each round, counts the open points on the server and its own jobs in Slurm, and submits the
missing jobs. A job ends when its worker finds no work (--idle-exit of oblique-worker; 10 minutes
in the installed script). Ctrl-C leaves the jobs in the queue; scancel --name NAME ends them.)";

constexpr std::array<std::string_view, 1> kSystems{"slurm"};

struct AutoscaleFlags {
  std::string system;
  JobLimits limits;
  std::string script;            // empty if not given
  std::string sbatch_arguments;  // separated by spaces
  std::string job_name;          // empty if not given
  double interval_s = 30.0;
  bool once = false;
  bool dry_run = false;
  SourceFlags source;
};

/// Finds and submits the Slurm jobs that have a given name. It runs `squeue` and `sbatch`.
class SlurmJobs {
 public:
  /// A wait for `squeue` ends when `keep_waiting` returns false.
  SlurmJobs(std::string name, std::string script, const std::string& sbatch_arguments,
            std::function<bool()> keep_waiting)
      : name_(std::move(name)), keep_waiting_(std::move(keep_waiting)) {
    for (const auto argument : protocol::split(sbatch_arguments, ' ')) {
      if (!argument.empty()) {
        arguments_.emplace_back(argument);
      }
    }
    arguments_.insert(arguments_.end(), {"--parsable", "--job-name=" + name_, std::move(script)});
  }

  const std::string& name() const { return name_; }

  /// Returns the number of our jobs that are pending or running.
  std::size_t count() const {
    const auto list =
        run("squeue", {"--noheader", "--me", "--array", "--name=" + name_, "--format=%T"}, true);
    std::size_t jobs = 0;
    for (const auto state : protocol::split(list, '\n')) {
      jobs += !state.empty() && state != "COMPLETING" ? 1U : 0U;
    }
    return jobs;
  }

  /// Submits a job and returns its number.
  std::string submit() const {
    const auto answer = run("sbatch", arguments_, false);
    return answer.substr(0, answer.find_first_of(";\n"));
  }

  std::string submission() const { return fmt::format("sbatch {}", fmt::join(arguments_, " ")); }

 private:
  std::string run(const std::string& program, const std::vector<std::string>& arguments,
                  bool may_stop) const {
    try {
      // Hides SQUEUE_PARTITION and similar variables from squeue. With them squeue would omit jobs,
      // and this command would submit too many.
      return output_of({.program = program, .arguments = arguments, .hidden_variables = "SQUEUE_"},
                       may_stop ? keep_waiting_ : nullptr);
    } catch (const ProgramNotFound&) {
      throw ProcessError(program +
                         " is not in PATH: run this command where Slurm's commands are installed");
    }
  }

  std::string name_;
  std::vector<std::string> arguments_;
  std::function<bool()> keep_waiting_;
};

/// Returns the path of the installed batch script, or an empty path if none is installed.
std::string installed_script() {
  const auto programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const auto script =
      programs.parent_path() / "share" / "oblique" / "slurm" / "oblique-workers.sbatch";
  return std::filesystem::exists(script) ? script.string() : std::string();
}

/// Throws InputError if the batch script needs an unset variable; warns if a key file is missing.
void check_variables(Console& console, const AutoscaleFlags& flags, const std::string& script) {
  constexpr const char* kServer = "OBLIQUE_WORKER_SERVER";
  constexpr const char* kKeys = "OBLIQUE_WORKER_KEYS";
  const auto is_set = [](const char* variable) {
    return !environment_variable(variable).value_or("").empty();
  };
  const auto is_given = [&](const char* variable) {
    // The job also gets variables from --sbatch-args "--export=ALL,OBLIQUE_WORKER_SERVER=...".
    return is_set(variable) || flags.sbatch_arguments.find(variable) != std::string::npos;
  };
  constexpr std::size_t kMaxBytes = std::size_t{1} << 20U;
  const std::string text = protocol::read_small_file(script, "the script", kMaxBytes);
  if (text.find(fmt::format("${{{}:?", kServer)) != std::string::npos && !is_given(kServer)) {
    throw solver::InputError(fmt::format(
        "{0} is not set, and {1} needs it: export {0}=tcp://HOST:7601, the server's address for "
        "workers",
        kServer, script));
  }
  const bool has_keys = !flags.source.keys.empty() || is_set("OBLIQUE_KEYS");
  if (has_keys && text.find(kKeys) != std::string::npos && !is_given(kKeys)) {
    console.note(fmt::format(
        "{} is not set, but this server has keys: it refuses workers without a key file.", kKeys));
  }
}

/// Checks combinations of flags and returns the batch script.
std::string checked_script(Console& console, const AutoscaleFlags& flags) {
  if (flags.limits.least > flags.limits.most) {
    throw solver::InputError(fmt::format("--min {} is not allowed: it must be at most --max {}",
                                         flags.limits.least, flags.limits.most));
  }
  if (flags.job_name.find(',') != std::string::npos) {
    throw solver::InputError(
        fmt::format("--name {} is not allowed: squeue reads a comma as the end of a name",
                    protocol::visible(flags.job_name)));
  }
  for (const auto argument : protocol::split(flags.sbatch_arguments, ' ')) {
    if (argument.starts_with("--array") || argument.starts_with("-a")) {
      throw solver::InputError(
          fmt::format("--sbatch-args {} is not allowed: each submission is one job", argument));
    }
  }
  const std::string script = flags.script.empty() ? installed_script() : flags.script;
  if (script.empty()) {
    throw solver::InputError(
        "--script FILE is missing: no script is installed with this program; the source tree has "
        "deploy/slurm/oblique-workers.sbatch");
  }
  check_variables(console, flags, script);
  return script;
}

/// Performs one round: submits the missing jobs or, with `dry_run`, prints the sbatch command.
void submit_missing(Console& console, Connection& connection, const SlurmJobs& slurm,
                    const AutoscaleFlags& flags) {
  const auto open = open_points(connection.full_status());
  const auto jobs = slurm.count();
  const auto missing = jobs_to_submit(open, jobs, flags.limits);
  const auto found = fmt::format("{} points are open and {} pending or running", format_count(open),
                                 counted(jobs, "job is", "jobs are"));
  if (flags.dry_run) {
    console.note(missing == 0 ? fmt::format("{}: would submit nothing", found)
                              : fmt::format("{}: would submit {} with: {}", found,
                                            counted(missing, "job", "jobs"), slurm.submission()));
    return;
  }
  if (missing > 0) {
    console.note(fmt::format("{}: submitting {}", found, counted(missing, "job", "jobs")));
  }
  for (std::size_t i = 0; i < missing; ++i) {
    console.note(fmt::format("submitted job {}", slurm.submit()));
  }
}

/// Calls `round` repeatedly until a signal arrives. Throws if the first round fails. Reports later
/// errors once and continues, because the server or Slurm may be unreachable for a while.
void repeat(Console& console, const std::function<void()>& round, double interval_s,
            protocol::StopSignals& stop) {
  const std::chrono::nanoseconds interval(std::llround(interval_s * 1e9));
  round();
  bool is_failing = false;
  while (!stop.wait(interval)) {
    try {
      round();
      if (std::exchange(is_failing, false)) {
        console.note("the last round succeeded again");
      }
    } catch (const std::exception& error) {
      if (!stop.requested() && !std::exchange(is_failing, true)) {
        console.note(
            fmt::format("{}; trying again every {}", error.what(), format_duration(interval_s)));
      }
    }
  }
}

int autoscale(const AutoscaleFlags& flags, Console& console) {
  const auto server = connection_settings(console, flags.source);
  const auto script = checked_script(console, flags);
  const auto default_name = "oblique@" + server.server_url.substr(server.server_url.rfind('/') + 1);
  protocol::StopSignals stop;  // created before any thread starts
  const auto keep_waiting = [&stop] { return !stop.requested(); };
  Connection connection(server, keep_waiting);
  const SlurmJobs slurm(flags.job_name.empty() ? default_name : flags.job_name, script,
                        flags.sbatch_arguments, keep_waiting);
  const auto round = [&] { submit_missing(console, connection, slurm, flags); };
  try {
    if (flags.once || flags.dry_run) {
      round();
      return kDone;
    }
    repeat(console, round, flags.interval_s, stop);
  } catch (const std::exception&) {
    if (!stop.requested()) {
      throw;
    }
  }
  console.note(fmt::format(
      "Stopped. Pending and running jobs continue; to end them: scancel --name {}", slurm.name()));
  return stop.exit_code();
}

}  // namespace

std::uint64_t open_points(const protocol::StatusReply& status) {
  std::uint64_t open = 0;
  for (const auto& study : status.studies()) {
    // The server gives this reason for a study that lacks only workers.
    const bool needs_workers = study.waits_for().empty() || study.waits_for() == "a worker";
    if (study.state() == "running" && needs_workers) {
      open += study.points() - std::min(study.points(), protocol::completed_points(study));
    }
  }
  return open;
}

std::size_t jobs_to_submit(std::uint64_t open_points, std::size_t jobs, const JobLimits& limits) {
  const std::uint64_t needed =
      open_points / limits.points_per_job + (open_points % limits.points_per_job > 0 ? 1 : 0);
  const auto wanted = std::clamp<std::uint64_t>(needed, limits.least, limits.most);
  return static_cast<std::size_t>(wanted) - std::min<std::size_t>(jobs, wanted);
}

void add_autoscale(CLI::App& app, Action& parsed) {
  constexpr double kDay_s = 86'400.0;
  auto [command, flags] =
      new_command(app, parsed, "autoscale", "Submit Slurm jobs with workers while points are open",
                  kAutoscaleExamples, autoscale);
  auto* system = command.add_option("SYSTEM", flags.system, "batch system: slurm")->required();
  protocol::note_choices(system, kSystems)
      ->check([](const std::string& name) {
        return name == kSystems[0] ? std::string()
                                   : fmt::format("`{}` is not allowed: it must be slurm", name);
      })
      ->type_name("");
  command
      .add_option("--min", flags.limits.least, "minimum number of jobs, even without open points")
      ->check(protocol::whole_number_from(0))
      ->type_name("N")
      ->capture_default_str();
  command.add_option("--max", flags.limits.most, "maximum number of jobs")
      ->required()
      ->check(protocol::whole_number_from(1))
      ->type_name("N");
  command.add_option("--points-per-job", flags.limits.points_per_job, "open points per job")
      ->check(protocol::whole_number_from(1))
      ->type_name("N")
      ->capture_default_str();
  command.add_option("--interval", flags.interval_s, "time between rounds [s]")
      ->check(protocol::number_between(0.1, kDay_s))
      ->type_name("SECONDS")
      ->capture_default_str();
  command
      .add_option("--script", flags.script,
                  "batch script that starts workers; default: the installed one")
      ->type_name("FILE");
  command
      .add_option("--sbatch-args", flags.sbatch_arguments,
                  "additional arguments for sbatch, separated by spaces")
      ->type_name("ARGS");
  command
      .add_option("--name", flags.job_name,
                  "name of the jobs; jobs of this name are counted; default: oblique@HOST:PORT")
      ->type_name("NAME");
  auto* once = command.add_flag("--once", flags.once, "run one round and exit, for cron");
  command.add_flag("--dry-run", flags.dry_run, "print what would be submitted now and exit")
      ->excludes(once);
  add_server_flags(command, flags.source);
}

}  // namespace oblique::client
