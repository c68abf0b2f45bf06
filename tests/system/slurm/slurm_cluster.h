#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/reserved_port.h"
#include "tests/support/temporary_folder.h"

namespace oblique::test {

/// A Slurm cluster on loopback: munged, slurmctld, and one slurmd for each of two nodes, n1 and n2.
/// The nodes are this machine under two names, with one core each. One folder contains all files of
/// the cluster. Jobs of the partition `urgent` preempt jobs of `work` (the default) and `grace`,
/// which are requeued. Preempted jobs of `grace` may run for 30 s more.
class SlurmCluster {
 public:
  /// Returns the reason why Slurm cannot run here; empty if it can.
  static std::string unavailable_reason();

  /// Starts the daemons and waits until all nodes are idle.
  explicit SlurmCluster(const TemporaryFolder& folder);
  /// Kills all daemons and jobs.
  ~SlurmCluster();
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

  /// Returns the environment of programs that use this cluster.
  Environment environment() const;

  /// Runs a Slurm command, such as `squeue`, with additional variables. Returns its standard output
  /// without the last line break. Throws std::runtime_error if the command fails.
  std::string run(const std::string& program, const std::vector<std::string>& arguments,
                  const Environment& more = {}) const;

  /// Returns a field of `scontrol show job`, such as "JobState"; empty if field or job is unknown.
  std::string field_of(const std::string& job, const std::string& field) const;
  void wait_for_state(const std::string& job, const std::string& state) const;
  /// Sets the start time of a pending job to now.
  void begin_now(const std::string& job) const;

  /// Returns the last lines of the controller's log.
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
