#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "client/autoscale/demand.h"
#include "client/autoscale/engine.h"
#include "client/autoscale/job_book.h"
#include "client/autoscale/rate_meter.h"

namespace oblique::client {

/// What an autoscaler keeps to; help texts print the defaults from here.
struct ScalingSettings {
  std::size_t least = 0;        ///< jobs, whatever there is to do
  std::size_t most = 1;         ///< jobs
  double target_s = 600.0;      ///< what is open should be done in so long
  double cool_down_s = 60.0;    ///< between submissions, and before jobs too many are retired
  double forget_after_s = 120;  ///< a job of which nothing is seen and heard is gone
  double patience_s = 60.0;     ///< a job asked to leave that stays longer is ended
  RateMeterSettings rate;
};

/// What was seen. None: whoever would say it does not answer.
struct Observation {
  std::optional<Demand> demand;
  std::optional<std::vector<ListedJob>> jobs;
};

/// What is to be done now.
struct Decision {
  std::size_t submit = 0;
  std::vector<std::string> withdraw;  ///< jobs that do not run yet
  std::vector<std::string> retire;
  std::vector<std::string> end;
  std::vector<std::string> sentences;  ///< why, and what else people should know

  bool changes_nothing() const {
    return submit == 0 && withdraw.empty() && retire.empty() && end.empty();
  }
};

/// Decides how many jobs there should be. No I/O, no clock: `now_s` is of any clock that never runs
/// backwards. README.md has the rules.
class Scaling {
 public:
  explicit Scaling(const ScalingSettings& settings);

  /// What follows from what was seen. What it says is taken to be done, but for submissions.
  Decision decide(const Observation& seen, double now_s);
  void note_submitted(const std::string& id, double now_s);
  /// The engine refused, or did not say whether it took a job.
  void note_submission_failed(double now_s);

  std::size_t jobs() const { return book_.count(); }

 private:
  void grow(std::size_t wanted, double now_s, Decision& decision);
  void shrink(std::size_t wanted, double now_s, Decision& decision);
  void end_those_that_stay(double now_s, Decision& decision);
  void wait_before_next(double now_s);
  std::string why(const Demand& demand, std::size_t wanted) const;

  const ScalingSettings settings_;
  JobBook book_;
  RateMeter rate_;
  bool was_away_ = false;
  double quiet_until_s_;  ///< nothing is submitted before
  int refused_ = 0;       ///< submissions in a row
  std::optional<double> too_many_since_s_;
  std::vector<std::string> blocked_;  ///< as told last
};

}  // namespace oblique::client
