#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/autoscale/demand.h"
#include "client/autoscale/engine.h"

namespace oblique::client {

/// Which jobs there are, of what the engine lists and what the server hears of their workers. Times
/// are of any clock that never runs backwards.
class JobBook {
 public:
  struct Job {
    JobState state = JobState::kPending;
    double known_since_s = 0.0;
    double running_since_s = 0.0;            ///< while it runs
    std::optional<double> absent_since_s{};  ///< neither listed nor heard of
    std::optional<double> idle_since_s{};    ///< it runs, and no worker of it has points
    std::optional<double> retired_s{};       ///< asked to leave, last
    JobWorkers workers{};                    ///< as heard last
    bool worked = false;                     ///< the server has heard a worker of it
    bool was_named = false;                  ///< it was told that none was heard
  };

  /// A job of which nothing was seen or heard for `forget_after_s` is gone.
  explicit JobBook(double forget_after_s) : forget_after_s_(forget_after_s) {}

  /// A job was submitted; the engine may not list it yet.
  void note_submitted(const std::string& id, double now_s);
  void note_retired(const std::string& id, double now_s) { jobs_.at(id).retired_s = now_s; }

  /// Takes in what the engine lists and the workers that the server knows. Gives sentences about
  /// jobs that are not as they should be.
  std::vector<std::string> update(const std::vector<ListedJob>& listed, const Demand& demand,
                                  double now_s);

  /// Those that are there to stay: neither leaving nor asked to.
  std::size_t count() const { return ids(stays).size(); }
  /// Ids of jobs that are as `wanted`, the newest first.
  std::vector<std::string> ids(const std::function<bool(const Job&)>& wanted) const;
  static bool stays(const Job& job);

  /// Threads of their workers, of a job on average, those left out whose workers are just coming or
  /// going; kept when there is no worker any more.
  std::optional<double> threads_a_job() const { return threads_a_job_; }
  /// Threads of the workers of all known jobs.
  std::size_t threads() const;
  /// Jobs in a row that ended unasked without a worker of theirs having been heard.
  int fruitless() const { return fruitless_; }

 private:
  void take_listed(const std::vector<ListedJob>& listed, double now_s);
  void take_workers(const Demand& demand, double now_s);
  std::vector<std::string> judge(double now_s);

  double forget_after_s_;
  std::map<std::string, Job> jobs_;
  std::optional<double> threads_a_job_;
  int fruitless_ = 0;
};

}  // namespace oblique::client
