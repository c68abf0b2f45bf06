#include "client/autoscale/slurm_engine.h"

#include <algorithm>
#include <initializer_list>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/autoscale/command.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

bool is_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

bool is_any_of(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// A long flag may be cut short, as --arr.
bool begins_any_of(std::string_view flag, std::initializer_list<std::string_view> flags) {
  return flag.size() > 1 && flag != "--" &&
         std::any_of(flags.begin(), flags.end(),
                     [flag](std::string_view one) { return one.starts_with(flag); });
}

/// What Slurm 22.05 calls states (squeue's %T), and what they mean here. One that nobody here knows
/// counts as a job that is there.
JobState state_named(std::string_view name) {
  if (is_any_of(name, {"PENDING", "CONFIGURING", "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED",
                       "SPECIAL_EXIT", "RESV_DEL_HOLD"})) {
    return JobState::kPending;
  }
  if (is_any_of(name, {"COMPLETING", "STAGE_OUT", "SIGNALING"})) {
    return JobState::kLeaving;
  }
  if (is_any_of(name, {"COMPLETED", "CANCELLED", "PREEMPTED", "DEADLINE", "REVOKED", "FAILED",
                       "TIMEOUT", "NODE_FAIL", "BOOT_FAIL", "OUT_OF_MEMORY"})) {
    return JobState::kEnded;
  }
  return JobState::kRunning;
}

/// An argument as a flag's name, without its value.
std::string_view flag_of(std::string_view argument) {
  return argument.starts_with("--") ? argument.substr(0, argument.find('='))
                                    : argument.substr(0, 2);
}

}  // namespace

SlurmEngine::SlurmEngine(SlurmSettings settings, std::function<bool()> keep_waiting)
    : settings_(std::move(settings)), keep_waiting_(std::move(keep_waiting)) {
  // squeue would take it for several names and find no job of ours, and more would be submitted.
  if (settings_.job_name.find(',') != std::string::npos) {
    throw solver::InputError(fmt::format("--name {} is not allowed: the name of jobs has no comma",
                                         protocol::visible(settings_.job_name)));
  }
  for (const auto& argument : settings_.sbatch_arguments) {
    if (begins_any_of(flag_of(argument), {"--array", "-a", "--job-name", "-J", "--comment",
                                          "--wrap", "--test-only", "--wait", "-W"})) {
      throw solver::InputError(
          fmt::format("--sbatch-args {} is not allowed: each submission is one job, found again by "
                      "its name and comment, and runs the script",
                      argument));
    }
  }
}

std::string SlurmEngine::run(const std::string& program, std::vector<std::string> arguments,
                             const std::function<bool()>& keep_waiting) const {
  try {
    // Variables that filter what squeue lists would hide jobs, and more would be submitted.
    return output_of({.program = program,
                      .arguments = std::move(arguments),
                      // Slurm says the same in several lines while it tries again.
                      .tells_last_line = program == "squeue",
                      .timeout_s = settings_.command_timeout_s,
                      .hidden_variables = "SQUEUE_",
                      .keep_waiting = keep_waiting});
  } catch (const CommandNotFound& error) {
    throw EngineError(fmt::format("Slurm's {}: run this where sbatch works", error.what()));
  } catch (const CommandError& error) {
    throw EngineError(error.what());
  }
}

std::vector<ListedJob> SlurmEngine::jobs() {
  const auto output = run("squeue",
                          {"--noheader", "--me", "--array", "--states=all",
                           "--name=" + settings_.job_name, "--format=%A|%T|%k"},
                          keep_waiting_);
  std::vector<ListedJob> jobs;
  for (const auto line : protocol::split(output, '\n')) {
    if (line.empty()) {
      continue;
    }
    const auto after_id = line.find('|');
    const auto after_state = line.find('|', after_id + 1);
    if (after_id == std::string_view::npos || after_state == std::string_view::npos ||
        !is_number(line.substr(0, after_id))) {
      throw EngineError(
          fmt::format("squeue lists what is no job: {}", protocol::visible(line.substr(0, 200))));
    }
    if (line.substr(after_state + 1) == settings_.comment) {
      jobs.push_back({std::string(line.substr(0, after_id)),
                      state_named(line.substr(after_id + 1, after_state - after_id - 1))});
    }
  }
  return jobs;
}

std::vector<std::string> SlurmEngine::submit_arguments() const {
  auto arguments = settings_.sbatch_arguments;
  arguments.insert(arguments.end(), {"--parsable", "--job-name=" + settings_.job_name,
                                     "--comment=" + settings_.comment, settings_.script});
  return arguments;
}

std::string SlurmEngine::submit() {
  const auto output = run("sbatch", submit_arguments());
  // 12, or 12;cluster
  const auto id = std::string_view(output).substr(0, output.find_first_of(";\n"));
  if (!is_number(id)) {
    throw EngineError(fmt::format("sbatch did not say a job's number but: {}",
                                  protocol::visible(output.substr(0, 200))));
  }
  return std::string(id);
}

void SlurmEngine::cancel(std::vector<std::string> arguments, const Ids& ids) const {
  if (ids.empty()) {
    return;
  }
  // Of a job that has ended meanwhile nothing is said.
  arguments.emplace_back("--quiet");
  arguments.insert(arguments.end(), ids.begin(), ids.end());
  static_cast<void>(run("scancel", std::move(arguments)));
}

void SlurmEngine::withdraw(const Ids& ids) {
  // One that has begun meanwhile goes on.
  cancel({"--state=PENDING"}, ids);
}

void SlurmEngine::retire(const Ids& ids) {
  // To the job's steps, that is to its workers; the job ends when they have left.
  cancel({"--signal=TERM"}, ids);
}

void SlurmEngine::end(const Ids& ids) {
  cancel({}, ids);
}

std::optional<std::string> SlurmEngine::job_of_worker(const std::string& name) const {
  constexpr std::string_view kBeginning = "slurm-";
  if (!name.starts_with(kBeginning)) {
    return std::nullopt;
  }
  const auto end = name.find('-', kBeginning.size());
  const auto id = name.substr(kBeginning.size(), end - kBeginning.size());
  return end != std::string::npos && is_number(id) ? std::optional(id) : std::nullopt;
}

std::string SlurmEngine::submission() const {
  std::string line = "sbatch";
  for (const auto& argument : submit_arguments()) {
    const bool is_plain = argument.find_first_of(" '\"$\\|;&<>()*?") == std::string::npos;
    line += is_plain ? " " + argument : fmt::format(" '{}'", argument);
  }
  return line;
}

}  // namespace oblique::client
