#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace oblique::client {

/// The engine does not answer, refuses, or says what nobody can read. The message is a sentence
/// part for people.
class EngineError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class JobState {
  kPending,  ///< waits for its nodes
  kRunning,
  kLeaving,  ///< about to end
  kEnded,    ///< whatever ended it
};

/// A job as the engine lists it.
struct ListedJob {
  std::string id;
  JobState state;
};

/// An engine that runs workers as jobs, each an allocation with one or more workers. Every call may
/// throw EngineError; what was asked for may have happened all the same.
class Engine {
 public:
  using Ids = std::vector<std::string>;

  virtual ~Engine() = default;

  /// The jobs that one autoscaler or several of the same name submitted for the same server, also
  /// before this process began. Ended ones may be missing.
  virtual std::vector<ListedJob> jobs() = 0;
  /// Submits one job; its id.
  virtual std::string submit() = 0;
  /// Takes those jobs from the queue that do not run yet, and no others.
  virtual void withdraw(const Ids& ids) = 0;
  /// Asks the workers of running jobs to deliver what they solved, give back the rest and leave.
  virtual void retire(const Ids& ids) = 0;
  /// Ends jobs that did not heed `retire`.
  virtual void end(const Ids& ids) = 0;

  /// The job that a worker of this name belongs to; none where it is no job of this engine.
  virtual std::optional<std::string> job_of_worker(const std::string& name) const = 0;
  /// How `submit` is said on a command line, for people.
  virtual std::string submission() const = 0;
};

}  // namespace oblique::client
