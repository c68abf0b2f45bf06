#include "client/autoscale/job_book.h"

#include <algorithm>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"

namespace oblique::client {
bool JobBook::stays(const Job& job) {
  return !job.retired_s && job.state != JobState::kLeaving;
}

void JobBook::note_submitted(const std::string& id, double now_s) {
  jobs_[id] = Job{.known_since_s = now_s};
}

void JobBook::take_listed(const std::vector<ListedJob>& listed, double now_s) {
  std::map<std::string, bool> is_listed;
  for (const auto& [id, state] : listed) {
    const auto known = jobs_.find(id);
    if (state == JobState::kEnded) {
      // One that had ended before it was known is none of ours to judge.
      if (known != jobs_.end()) {
        fruitless_ += !known->second.worked && !known->second.retired_s ? 1 : 0;
        jobs_.erase(known);
      }
      continue;
    }
    is_listed[id] = true;
    auto& job = known != jobs_.end() ? known->second
                                     : jobs_.emplace(id, Job{.known_since_s = now_s}).first->second;
    if (state != job.state && state == JobState::kPending) {
      job = Job{.known_since_s = now_s};  // queued again: another life
    }
    if (state == JobState::kRunning && job.state != JobState::kRunning) {
      job.running_since_s = now_s;
    }
    job.state = state;
  }
  for (auto& [id, job] : jobs_) {
    if (is_listed.contains(id)) {
      job.absent_since_s.reset();
    } else if (!job.absent_since_s) {
      job.absent_since_s = now_s;
    }
  }
}

void JobBook::take_workers(const Demand& demand, double now_s) {
  std::size_t steady_jobs = 0;
  std::size_t their_threads = 0;
  for (auto& [id, job] : jobs_) {
    const auto found = demand.jobs.find(id);
    const auto before =
        std::exchange(job.workers, found == demand.jobs.end() ? JobWorkers() : found->second);
    if (job.state != JobState::kRunning || job.workers.leased_points > 0) {
      job.idle_since_s.reset();
    } else {
      job.idle_since_s = job.idle_since_s.value_or(now_s);
    }
    if (job.workers.workers == 0) {
      continue;
    }
    job.worked = true;
    job.absent_since_s.reset();
    fruitless_ = 0;
    if (!threads_a_job_ || before.threads == job.workers.threads) {
      ++steady_jobs;
      their_threads += job.workers.threads;
    }
  }
  if (steady_jobs > 0) {
    threads_a_job_ = static_cast<double>(their_threads) / static_cast<double>(steady_jobs);
  }
}

std::vector<std::string> JobBook::judge(double now_s) {
  std::vector<std::string> sentences;
  for (auto entry = jobs_.begin(); entry != jobs_.end();) {
    auto& [id, job] = *entry;
    if (job.absent_since_s && now_s - *job.absent_since_s >= forget_after_s_) {
      sentences.push_back(
          fmt::format("job {} vanished: it is not listed any more, and nothing was heard of a "
                      "worker of it for {}; it is forgotten",
                      id, shown_duration(now_s - *job.absent_since_s)));
      entry = jobs_.erase(entry);
      continue;
    }
    if (job.state == JobState::kRunning && !job.worked && !job.was_named &&
        now_s - job.running_since_s >= forget_after_s_) {
      job.was_named = true;
      sentences.push_back(fmt::format(
          "job {} has run for {}, and the server has heard of no worker of it: see what it wrote",
          id, shown_duration(now_s - job.running_since_s)));
    }
    ++entry;
  }
  return sentences;
}

std::vector<std::string> JobBook::update(const std::vector<ListedJob>& listed, const Demand& demand,
                                         double now_s) {
  take_listed(listed, now_s);
  take_workers(demand, now_s);
  return judge(now_s);
}

std::vector<std::string> JobBook::ids(const std::function<bool(const Job&)>& wanted) const {
  std::vector<std::string> found;
  for (const auto& [id, job] : jobs_) {
    if (wanted(job)) {
      found.push_back(id);
    }
  }
  // Ids count upwards. Every autoscaler has the same order, so that two retire the same ones.
  std::sort(found.begin(), found.end(), [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() > b.size() : a > b;
  });
  return found;
}

std::size_t JobBook::threads() const {
  std::size_t threads = 0;
  for (const auto& [id, job] : jobs_) {
    threads += job.workers.threads;
  }
  return threads;
}

}  // namespace oblique::client
