#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/autoscale/autoscaler.h"
#include "client/autoscale/slurm_engine.h"
#include "client/service/source_flags.h"
#include "client/service/watching.h"
#include "client/verbs/verbs.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"
#include "proto/small_file.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kAutoscaleExamples = R"(Examples:
  oblique autoscale slurm --max 10 --script oblique-workers.sbatch
  oblique autoscale slurm --min 1 --max 20 --target 1800 --sbatch-args "--partition=short -A lab7"
  oblique autoscale slurm --max 10 --dry-run          what it would do now
  oblique autoscale slurm --max 10 --once             one look, for cron
  oblique autoscale slurm --retire                    has all of its jobs leave
Before, for the workers of the jobs:
  export OBLIQUE_WORKER_SERVER=tcp://head:7601 OBLIQUE_WORKER_KEYS=~/oblique/worker.key

Submits jobs with workers (deploy/slurm) while points are open, as many as settle them within the
target, and has those leave that idle. Ctrl-C leaves the jobs running; started again it finds them.)";

constexpr std::array<std::string_view, 1> kEngines{"slurm"};

struct AutoscaleFlags {
  std::string engine;
  std::optional<std::size_t> most;
  ScalingSettings scaling;
  SlurmSettings slurm;
  std::string sbatch_arguments;
  double poll_s = 15.0;
  bool once = false;
  bool only_tells = false;
  bool retires = false;
  SourceFlags source;
};

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The script that is installed with the programs; empty where none is.
std::string installed_script() {
  const auto programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const auto script =
      programs.parent_path() / "share" / "oblique" / "slurm" / "oblique-workers.sbatch";
  return std::filesystem::exists(script) ? script.string() : std::string();
}

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

/// Jobs whose script has no server to go to would fail one after the other.
void check_variables(const AutoscaleFlags& flags, const std::string& script) {
  constexpr const char* kServer = "OBLIQUE_WORKER_SERVER";
  constexpr const char* kKeys = "OBLIQUE_WORKER_KEYS";
  const auto is_given = [&flags](const char* variable) {
    // --sbatch-args "--export=ALL,OBLIQUE_WORKER_SERVER=..." will do too.
    return is_set(variable) || flags.sbatch_arguments.find(variable) != std::string::npos;
  };
  constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
  const std::string text = protocol::read_small_file(script, "the script", kMostBytes);
  if (text.find(fmt::format("${{{}:?", kServer)) != std::string::npos && !is_given(kServer)) {
    throw solver::InputError(
        fmt::format("{} is not set, and {} needs it: export {}=tcp://HOST:7601, where the server "
                    "awaits workers",
                    kServer, script, kServer));
  }
  const bool has_keys = !flags.source.keys.empty() || is_set("OBLIQUE_KEYS");
  if (has_keys && text.find(kKeys) != std::string::npos && !is_given(kKeys)) {
    tell_line(
        fmt::format("{} is not set, and this server has keys: without a worker's key file "
                    "the workers of the jobs are turned away.",
                    kKeys));
  }
}

SlurmSettings slurm_settings(const AutoscaleFlags& flags, const std::string& server_url) {
  auto settings = flags.slurm;
  for (const auto argument : protocol::split(flags.sbatch_arguments, ' ')) {
    if (!argument.empty()) {
      settings.sbatch_arguments.emplace_back(argument);
    }
  }
  settings.comment = "oblique autoscale for " + server_url;
  if (settings.script.empty()) {
    settings.script = installed_script();
  }
  const bool submits = !flags.retires;
  if (submits && settings.script.empty()) {
    throw solver::InputError(
        "--script FILE is needed: no script is installed beside this program. It is "
        "deploy/slurm/oblique-workers.sbatch in the source tree");
  }
  if (submits) {
    check_variables(flags, settings.script);
  }
  return settings;
}

ScalingSettings scaling_settings(const AutoscaleFlags& flags) {
  auto settings = flags.scaling;
  if (!flags.most) {
    throw solver::InputError("--max is needed: the most jobs that there may be at a time");
  }
  settings.most = *flags.most;
  if (settings.least > settings.most) {
    throw solver::InputError(fmt::format("--min {} is not allowed: it is more than --max {}",
                                         settings.least, settings.most));
  }
  if (flags.once || flags.only_tells) {
    // There is no later look that could know better.
    settings.cool_down_s = 0.0;
    settings.rate.settle_s = 0.0;
  }
  return settings;
}

int retire(Engine& engine, const AutoscaleFlags& flags, protocol::StopSignals& stop) {
  const auto wait = [&](double seconds) {
    return !flags.once && !stop.wait(std::chrono::nanoseconds(std::llround(seconds * 1e9)));
  };
  try {
    if (retire_all(engine, flags.scaling.patience_s, wait, tell_line)) {
      std::cerr << "No job is left.\n";
      return kDone;
    }
  } catch (const Interrupted&) {
    return stop.exit_code();
  }
  return flags.once ? kDone : stop.exit_code();
}

int keep_scaling(Autoscaler& autoscaler, const AutoscaleFlags& flags, protocol::StopSignals& stop) {
  do {
    autoscaler.look(now_s());
  } while (!stop.wait(std::chrono::nanoseconds(std::llround(flags.poll_s * 1e9))));
  throw Interrupted("");
}

int autoscale(const AutoscaleFlags& flags) {
  const auto server = connection_settings(flags.source);
  const auto scaling = flags.retires ? flags.scaling : scaling_settings(flags);
  auto slurm = slurm_settings(flags, server.server_url);
  protocol::StopSignals stop;  // before any thread starts
  const auto goes_on = [&stop] { return !stop.requested(); };
  SlurmEngine engine(std::move(slurm), goes_on);
  if (flags.retires) {
    return retire(engine, flags, stop);
  }
  Connection connection(server, goes_on);
  const auto ask = [&] {
    return demand_of(connection.status(""), connection.workers(),
                     [&](const std::string& name) { return engine.job_of_worker(name); });
  };
  Autoscaler autoscaler(scaling, engine, ask, tell_line);
  try {
    if (flags.once || flags.only_tells) {
      return autoscaler.look(now_s(), flags.only_tells) ? kDone : kFailed;
    }
    return keep_scaling(autoscaler, flags, stop);
  } catch (const Interrupted&) {
    std::cerr << fmt::format(
        "Stopped. {} on; to have them leave: oblique autoscale slurm --retire\n",
        autoscaler.jobs() == 1 ? std::string("1 job goes")
                               : fmt::format("{} jobs go", autoscaler.jobs()));
    return stop.exit_code();
  }
}

void add_slurm_flags(CLI::App& verb, AutoscaleFlags& flags) {
  verb.add_option("--script", flags.slurm.script,
                  "batch script that runs workers; default: the one installed with this program")
      ->type_name("FILE");
  verb.add_option("--sbatch-args", flags.sbatch_arguments,
                  "more arguments of sbatch, with spaces between them")
      ->type_name("ARGS");
  verb.add_option("--name", flags.slurm.job_name,
                  "name of the jobs; autoscalers of one name and server share them")
      ->type_name("NAME")
      ->capture_default_str();
}

void add_scaling_flags(CLI::App& verb, AutoscaleFlags& flags) {
  constexpr std::size_t kMostJobs = 10'000;
  constexpr double kDay_s = 86'400.0;
  auto& scaling = flags.scaling;
  verb.add_option("--min", scaling.least, "jobs that are kept, whatever there is to do")
      ->check(CLI::Range(std::size_t{0}, kMostJobs))
      ->type_name("N")
      ->capture_default_str();
  verb.add_option("--max", flags.most, "most jobs at a time; REQUIRED unless --retire")
      ->check(CLI::Range(std::size_t{1}, kMostJobs))
      ->type_name("N");
  verb.add_option("--target", scaling.target_s, "what is open should be done in so long [s]")
      ->check(protocol::number_between(1.0, 365.0 * kDay_s))
      ->type_name("SECONDS")
      ->capture_default_str();
  verb.add_option("--poll", flags.poll_s, "time between looks [s]")
      ->check(protocol::number_between(0.1, kDay_s))
      ->type_name("SECONDS")
      ->capture_default_str();
  verb.add_option("--cool-down", scaling.cool_down_s,
                  "time between submissions, and before jobs too many are retired [s]")
      ->check(protocol::number_between(0.0, kDay_s))
      ->type_name("SECONDS")
      ->capture_default_str();
  verb.add_option("--forget", scaling.forget_after_s,
                  "a job that is not listed and has no worker is forgotten after so long [s]")
      ->check(protocol::number_between(0.0, kDay_s))
      ->type_name("SECONDS")
      ->capture_default_str();
}

}  // namespace

void add_autoscale(CLI::App& app, Command& command) {
  auto flags = std::make_shared<AutoscaleFlags>();
  auto* verb = app.add_subcommand(
      "autoscale", "Submit jobs with workers to a cluster while there is work, and retire them");
  verb->footer(kAutoscaleExamples);
  auto* engine = verb->add_option("ENGINE", flags->engine, "what runs the jobs: slurm")->required();
  protocol::note_choices(engine, kEngines);
  engine
      ->check([](const std::string& name) {
        return name == kEngines[0] ? std::string()
                                   : fmt::format("there is no `{}`{}: jobs are run by {}", name,
                                                 protocol::did_you_mean(name, kEngines),
                                                 protocol::joined(kEngines));
      })
      ->type_name("");
  add_scaling_flags(*verb, *flags);
  add_slurm_flags(*verb, *flags);
  auto* once = verb->add_flag("--once", flags->once, "look once, for cron");
  auto* dry_run =
      verb->add_flag("--dry-run", flags->only_tells, "look once and say what would be done");
  verb->add_flag("--retire", flags->retires, "have all of its jobs leave, and wait until they have")
      ->excludes(dry_run);
  once->excludes(dry_run);
  add_server_flags(*verb, flags->source);
  verb->callback([flags, &command] { command = [flags] { return autoscale(*flags); }; });
}

}  // namespace oblique::client
