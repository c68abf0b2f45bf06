#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/reserved_port.h"
#include "tests/support/temporary_folder.h"

namespace oblique::test {

/// A Slurm of our own: munged, slurmctld and a slurmd for each of two nodes, n1 and n2, which are
/// this machine under two names and have one core each. Everything of it is in the folder; it
/// listens on loopback. Partitions: `work` (the default), `grace`, whose preempted jobs have
/// 30 s, both with requeueing, and `urgent`, which preempts them.
class SlurmCluster {
 public:
  /// Why the cluster cannot run here; empty: it can.
  static std::string objection();

  /// All nodes are idle when constructed.
  explicit SlurmCluster(const TemporaryFolder& folder);
  /// Kills every process of the cluster, including jobs.
  ~SlurmCluster();
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

  /// Variables for programs that use this cluster.
  Environment environment() const;

  /// Runs a Slurm command such as `srun` or `squeue` with additional variables. Returns its
  /// standard output without the last line break. Throws std::runtime_error on failure.
  std::string run(const std::string& program, const std::vector<std::string>& arguments,
                  const Environment& more = {}) const;

  /// A field of `scontrol show job`, such as "JobState"; empty if the field or the job does not
  /// exist.
  std::string field_of(const std::string& job, const std::string& field) const;
  void wait_for_state(const std::string& job, const std::string& state) const;
  /// Starts a job at once that waits for its start time.
  void begin_now(const std::string& job) const;

  /// The end of the controller's log, for failures.
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
