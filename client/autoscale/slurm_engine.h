#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/autoscale/engine.h"

namespace oblique::client {

/// How jobs are submitted; help texts print the defaults from here.
struct SlurmSettings {
  std::string script;                         ///< for sbatch
  std::vector<std::string> sbatch_arguments;  ///< more of them
  std::string job_name{"oblique-autoscale"};
  std::string comment;              ///< with the name it tells whose jobs they are
  double command_timeout_s = 30.0;  ///< for each of sbatch, squeue and scancel
};

/// Slurm, asked by `sbatch`, `squeue` and `scancel`. A job is its own when it has the name and the
/// comment, and belongs to the user who asks.
class SlurmEngine : public Engine {
 public:
  /// Throws solver::InputError for arguments of sbatch that would make jobs it cannot find again.
  /// `keep_waiting` may end the wait for a list of jobs, which then throws Interrupted. Orders are
  /// waited for: what becomes of them should be known.
  explicit SlurmEngine(SlurmSettings settings, std::function<bool()> keep_waiting = {});

  std::vector<ListedJob> jobs() override;
  std::string submit() override;
  void withdraw(const Ids& ids) override;
  void retire(const Ids& ids) override;
  void end(const Ids& ids) override;
  /// Workers of deploy/slurm/oblique-workers.sbatch are called slurm-JOB-NODE.
  std::optional<std::string> job_of_worker(const std::string& name) const override;
  std::string submission() const override;

 private:
  std::string run(const std::string& program, std::vector<std::string> arguments,
                  const std::function<bool()>& keep_waiting = {}) const;
  void cancel(std::vector<std::string> arguments, const Ids& ids) const;
  std::vector<std::string> submit_arguments() const;

  const SlurmSettings settings_;
  const std::function<bool()> keep_waiting_;
};

}  // namespace oblique::client
