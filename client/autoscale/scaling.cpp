#include "client/autoscale/scaling.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/autoscale/need.h"
#include "client/output/human_units.h"

namespace oblique::client {
namespace {

bool waits(const JobBook::Job& job) {
  return JobBook::stays(job) && job.state == JobState::kPending;
}
bool works(const JobBook::Job& job) {
  return JobBook::stays(job) && job.state == JobState::kRunning && job.workers.leased_points > 0;
}

std::string counted(std::size_t jobs) {
  return fmt::format("{} {}", jobs, jobs == 1 ? "job" : "jobs");
}

}  // namespace

Scaling::Scaling(const ScalingSettings& settings)
    : settings_(settings),
      book_(settings.forget_after_s),
      rate_(settings.rate),
      quiet_until_s_(std::numeric_limits<double>::lowest()) {}

Decision Scaling::decide(const Observation& seen, double now_s) {
  Decision decision;
  if (!seen.demand || !seen.jobs) {
    // Nobody knows what there is to do, or who does it: nothing changes.
    was_away_ = was_away_ || !seen.demand;
    too_many_since_s_.reset();
    rate_.interrupt();
    return decision;
  }
  decision.sentences = book_.update(*seen.jobs, *seen.demand, now_s);
  rate_.update(*seen.demand, now_s);
  if (std::exchange(blocked_, seen.demand->blocked) != seen.demand->blocked) {
    for (const auto& study : blocked_) {
      decision.sentences.push_back(fmt::format("{}: no job is submitted for it", study));
    }
  }
  if (std::exchange(was_away_, false)) {
    // The workers come back one after another, and to leases that ran out.
    quiet_until_s_ = std::max(quiet_until_s_, now_s + settings_.cool_down_s);
  }
  const auto ours = book_.threads();
  const Capacity capacity{rate_.points_per_s_a_thread(), book_.threads_a_job(),
                          seen.demand->threads - std::min(ours, seen.demand->threads)};
  const auto needed =
      jobs_needed(seen.demand->open_points, capacity, settings_.target_s, book_.count());
  const auto wanted = std::clamp(needed, settings_.least, settings_.most);
  const auto reason = why(*seen.demand, wanted);
  grow(wanted, now_s, decision);
  shrink(wanted, now_s, decision);
  if (!decision.changes_nothing()) {
    decision.sentences.push_back(reason);
  }
  end_those_that_stay(now_s, decision);
  return decision;
}

void Scaling::grow(std::size_t wanted, double now_s, Decision& decision) {
  if (book_.count() >= wanted || now_s < quiet_until_s_) {
    return;
  }
  decision.submit = wanted - book_.count();
  wait_before_next(now_s);
}

void Scaling::shrink(std::size_t wanted, double now_s, Decision& decision) {
  if (book_.count() <= wanted) {
    too_many_since_s_.reset();
    return;
  }
  too_many_since_s_ = too_many_since_s_.value_or(now_s);
  if (now_s - *too_many_since_s_ < settings_.cool_down_s || now_s < quiet_until_s_) {
    return;
  }
  const auto take = [&](const auto& kind, std::size_t limit, std::vector<std::string>& into) {
    for (const auto& id : book_.ids(kind)) {
      if (book_.count() <= limit) {
        return;
      }
      book_.note_retired(id, now_s);
      into.push_back(id);
    }
  };
  take(waits, wanted, decision.withdraw);
  const auto has_idled = [&](const JobBook::Job& job) {
    return JobBook::stays(job) && job.idle_since_s &&
           now_s - *job.idle_since_s >= settings_.cool_down_s;
  };
  take(has_idled, wanted, decision.retire);
  // A job at work costs no more for working to the end, and the study ends sooner.
  take(works, settings_.most, decision.retire);
}

void Scaling::end_those_that_stay(double now_s, Decision& decision) {
  decision.end = book_.ids([&](const JobBook::Job& job) {
    return job.retired_s && now_s - *job.retired_s >= settings_.patience_s;
  });
  for (const auto& id : decision.end) {
    book_.note_retired(id, now_s);
    decision.sentences.push_back(
        fmt::format("job {} was asked to leave {} ago and is there still: it is ended", id,
                    shown_duration(settings_.patience_s)));
  }
}

void Scaling::wait_before_next(double now_s) {
  constexpr int kMostDoublings = 6;
  const int doublings = std::min(kMostDoublings, book_.fruitless() + refused_);
  quiet_until_s_ = now_s + settings_.cool_down_s * (1 << doublings);
}

void Scaling::note_submitted(const std::string& id, double now_s) {
  book_.note_submitted(id, now_s);
  refused_ = 0;
}

void Scaling::note_submission_failed(double now_s) {
  ++refused_;
  wait_before_next(now_s);
}

std::string Scaling::why(const Demand& demand, std::size_t wanted) const {
  const auto rate = rate_.points_per_s_a_thread();
  const std::string speed =
      rate ? fmt::format("{} points/s a thread, {} threads", shown_rate(*rate), demand.threads)
           : fmt::format("no rate measured yet, {} threads", demand.threads);
  return fmt::format("{} points are open ({}): {} wanted, {} there",
                     shown_count(demand.open_points), speed, counted(wanted), book_.count());
}

}  // namespace oblique::client
