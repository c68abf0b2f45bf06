#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/reserved_port.h"
#include "tests/support/temporary_folder.h"

namespace oblique::test {

/// A Slurm cluster on loopback: munged, slurmctld, and a slurmd for each of two nodes, n1 and n2,
/// which are this machine under two names, with one core each. All its files are in the folder.
/// Partitions: `work` (the default) and `grace` (30 s for preempted jobs), both with requeueing;
/// `urgent` preempts them.
class SlurmCluster {
 public:
  /// Reason why Slurm cannot run here; empty if it can.
  static std::string objection();

  /// Starts the daemons and waits until all nodes are idle.
  explicit SlurmCluster(const TemporaryFolder& folder);
  /// Kills all daemons and jobs.
  ~SlurmCluster();
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

  /// Environment of programs that use this cluster.
  Environment environment() const;

  /// Runs `srun`, `squeue`, ... with additional variables. Returns its standard output without the
  /// last line break. Throws std::runtime_error if it fails.
  std::string run(const std::string& program, const std::vector<std::string>& arguments,
                  const Environment& more = {}) const;

  /// A field of `scontrol show job`, such as "JobState"; empty if the field or the job is unknown.
  std::string field_of(const std::string& job, const std::string& field) const;
  void wait_for_state(const std::string& job, const std::string& state) const;
  /// Sets the start time of a pending job to now.
  void begin_now(const std::string& job) const;

  /// The last lines of the controller's log.
  std::string log() const;

 private:
  void write_configuration() const;
  void start_authentication();
  std::unique_ptr<Process> started(const std::string& program,
                                   const std::vector<std::string>& arguments) const;
  void wait_for_nodes() const;

  const TemporaryFolder& folder_;
  ReservedPort controller_port_;
  ReservedPort first_node_port_;
  ReservedPort second_node_port_;
  std::unique_ptr<Process> authentication_;
  std::unique_ptr<Process> controller_;
  std::vector<std::unique_ptr<Process>> nodes_;
};

}  // namespace oblique::test
