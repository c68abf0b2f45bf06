#include "server/writer.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <set>
#include <type_traits>
#include <utility>
#include <variant>

#include "server/sqlite.h"

namespace oblique::server {
namespace {

/// Jobs in one transaction at most, so that acknowledgements do not wait long.
constexpr std::size_t kLargestGroup = 256;

/// Pause before a faulty database is tried again.
constexpr std::chrono::milliseconds kRetryPause{500};

/// The study that a change is of; 0: of none.
std::uint64_t study_of(const Change& change) {
  return std::visit(
      [](const auto& c) -> std::uint64_t {
        if constexpr (std::is_same_v<std::decay_t<decltype(c)>, AddWorker>) {
          return 0;
        } else {
          return c.study_id;
        }
      },
      change);
}

}  // namespace

Writer::Writer(Storage& storage, Report report)
    : commits_(storage), report_(std::move(report)), thread_([this] { run(); }) {}

Writer::~Writer() {
  finish();
}

void Writer::submit(WriteJob job) {
  const std::lock_guard lock(mutex_);
  queue_.push_back(std::move(job));
  wake_.notify_one();
}

std::size_t Writer::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
    wake_.notify_one();
  }
  if (thread_.joinable()) {
    thread_.join();
  }
  return left_over_;
}

void Writer::run() {
  std::deque<WriteJob> jobs;  // taken from the queue, not yet durable
  while (true) {
    bool last_round = false;
    {
      std::unique_lock lock(mutex_);
      if (commits_.is_faulty()) {
        wake_.wait_for(lock, kRetryPause, [this] { return finishing_; });
      } else if (jobs.empty()) {
        wake_.wait(lock, [this] { return finishing_ || !queue_.empty(); });
      }
      std::move(queue_.begin(), queue_.end(), std::back_inserter(jobs));
      queue_.clear();
      last_round = finishing_;
    }
    const bool was_faulty = commits_.is_faulty();
    auto reports = jobs.empty() ? std::vector<WriteReport>() : commits_.write(jobs);
    if (!reports.empty()) {
      report_(std::move(reports));
    }
    if (last_round && (jobs.empty() || (was_faulty && commits_.is_faulty()))) {
      left_over_ = jobs.size();
      return;
    }
  }
}

std::vector<WriteReport> GroupCommit::write(std::deque<WriteJob>& jobs) {
  std::vector<WriteReport> reports;
  if (!jobs.empty() && !write_group(jobs, reports)) {
    write_singly(jobs, reports);
  }
  return reports;
}

bool GroupCommit::write_group(std::deque<WriteJob>& jobs, std::vector<WriteReport>& reports) {
  const std::size_t size = std::min(jobs.size(), kLargestGroup);
  std::vector<Change> changes;
  changes.reserve(size);
  for (std::size_t i = 0; i < size; ++i) {
    changes.push_back(std::move(jobs[i].change));
  }
  try {
    storage_.commit(changes);
  } catch (const StorageError&) {
    for (std::size_t i = 0; i < size; ++i) {
      jobs[i].change = std::move(changes[i]);
    }
    return false;  // which of them failed is found by trying each alone
  }
  if (std::exchange(faulty_, false)) {
    reports.push_back({WriteReport::Kind::kRecovered, 0, {}});
  }
  for (std::size_t i = 0; i < size; ++i) {
    reports.push_back({WriteReport::Kind::kStored, jobs[i].ticket, {}});
  }
  jobs.erase(jobs.begin(), jobs.begin() + static_cast<std::ptrdiff_t>(size));
  return true;
}

void GroupCommit::write_singly(std::deque<WriteJob>& jobs, std::vector<WriteReport>& reports) {
  std::deque<WriteJob> kept;
  std::set<std::uint64_t> waiting;  // studies with a job among those kept
  std::string fault;
  const auto keep = [&](WriteJob& job) {
    waiting.insert(study_of(job.change));
    kept.push_back(std::move(job));
  };
  for (WriteJob& job : jobs) {
    // Behind a job that is kept nothing of its kind is tried, nor anything else of its study: done
    // and then retried must not become retried and then done.
    if (!fault.empty() && !job.answer_failure) {
      keep(job);
      continue;
    }
    if (waiting.contains(study_of(job.change))) {
      reports.push_back({WriteReport::Kind::kRefused, job.ticket, fault});
      continue;
    }
    try {
      storage_.commit({&job.change, 1});
      reports.push_back({WriteReport::Kind::kStored, job.ticket, {}});
    } catch (const StorageError& error) {
      if (job.answer_failure) {
        reports.push_back({WriteReport::Kind::kRefused, job.ticket, error.what()});
      } else {
        fault = error.what();
        keep(job);
      }
    }
  }
  jobs = std::move(kept);
  if (faulty_ != !fault.empty()) {
    faulty_ = !fault.empty();
    reports.push_back(
        {faulty_ ? WriteReport::Kind::kFault : WriteReport::Kind::kRecovered, 0, fault});
  }
}

}  // namespace oblique::server
