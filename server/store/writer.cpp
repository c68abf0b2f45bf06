#include "server/store/writer.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <iterator>
#include <set>
#include <utility>
#include <variant>

#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

/// Maximum number of jobs in one transaction. It limits the time until results are acknowledged.
constexpr std::size_t kLargestGroup = 256;

constexpr std::chrono::milliseconds kRetryPause{500};

/// Interval between calls of `maintain` while no job waits.
constexpr std::chrono::milliseconds kTendPause{1000};

/// Number of rows of deleted studies that are deleted at a time (about 10 ms). Waiting jobs are
/// written in between. After a failure the next attempt waits for `kClearPause`.
constexpr std::size_t kRowsAtOnce = 1000;
constexpr std::chrono::milliseconds kClearPause{1000};

/// Number of failed attempts to merge the log before the failure is reported.
constexpr int kQuietTries = 5;

/// Number of attempts to merge the log at the end, and the pause between them: three seconds in
/// all.
constexpr int kLastTries = 15;
constexpr std::chrono::milliseconds kLastPause{200};

bool ends_a_study(const Change& change) {
  const auto* state = std::get_if<SetStudyState>(&change);
  return state != nullptr && state->state == StudyState::kDone;
}

}  // namespace

Writer::Writer(Storage& storage, Report report, std::chrono::milliseconds longest_last_step)
    : storage_(storage),
      longest_last_step_(longest_last_step),
      commits_(storage),
      report_(std::move(report)),
      thread_([this] {
        run();
        const std::lock_guard lock(mutex_);
        has_ended_ = true;
        ended_.notify_all();
      }) {}

Writer::~Writer() {
  finish();
}

void Writer::submit(WriteJob job) {
  const std::lock_guard lock(mutex_);
  queue_.push_back(std::move(job));
  wake_.notify_one();
}

void Writer::resume_deletions() {
  const std::lock_guard lock(mutex_);
  resumes_ = true;
  wake_.notify_one();
}

std::size_t Writer::finish() {
  {
    std::unique_lock lock(mutex_);
    finishing_ = true;
    wake_.notify_one();
    for (std::uint64_t seen = steps_;
         !ended_.wait_for(lock, longest_last_step_, [this] { return has_ended_; });) {
      if (std::exchange(seen, steps_) == steps_) {
        storage_.interrupt();
      }
    }
  }
  if (thread_.joinable()) {
    thread_.join();
  }
  return left_over_;
}

void Writer::run() {
  std::deque<WriteJob> jobs;  // jobs that were removed from the queue and are not durable yet
  while (true) {
    bool last_round = false;
    {
      std::unique_lock lock(mutex_);
      if (commits_.is_faulty() || commits_.is_gone()) {
        wake_.wait_for(lock, kRetryPause, [this] { return finishing_; });
      } else if (jobs.empty() && !may_clear()) {
        wake_.wait_for(lock, kTendPause,
                       [this] { return finishing_ || resumes_ || !queue_.empty(); });
      }
      std::move(queue_.begin(), queue_.end(), std::back_inserter(jobs));
      queue_.clear();
      last_round = finishing_;
      ++steps_;
      if (std::exchange(resumes_, false)) {
        commits_.resume_deletions();
      }
    }
    const bool was_faulty = commits_.is_faulty();
    auto reports = !jobs.empty() ? write(jobs)
                   : may_clear() ? std::vector<WriteReport>()
                                 : commits_.maintain();
    if (may_clear() && !last_round && !commits_.clear(kRowsAtOnce, reports)) {
      clears_from_ = std::chrono::steady_clock::now() + kClearPause;
    }
    if (!reports.empty()) {
      report_(std::move(reports));
    }
    const bool gives_up = commits_.is_gone() || (was_faulty && commits_.is_faulty());
    if (last_round && (jobs.empty() || gives_up)) {
      left_over_ = jobs.size();
      merge_before_the_end();
      return;
    }
  }
}

std::vector<WriteReport> Writer::write(std::deque<WriteJob>& jobs) {
  const auto began = std::chrono::steady_clock::now();
  const std::uint64_t rows_before = commits_.rows();
  auto reports = commits_.write(jobs);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - began;
  const std::lock_guard lock(mutex_);
  counts_.duration_s.observe(taken.count());
  counts_.rows.observe(static_cast<double>(commits_.rows() - rows_before));
  return reports;
}

bool Writer::may_clear() const {
  return commits_.has_to_clear() && !commits_.is_faulty() &&
         std::chrono::steady_clock::now() >= clears_from_;
}

CommitCounts Writer::commits() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void Writer::merge_before_the_end() {
  if (commits_.is_faulty()) {
    return;  // the caller reports the jobs that were not stored
  }
  std::vector<WriteReport> reports;
  bool merged = false;
  for (int tries = 0; !merged && !commits_.is_gone() && tries < kLastTries; ++tries) {
    if (tries > 0) {
      std::this_thread::sleep_for(kLastPause);
    }
    merged = commits_.merge(reports);
  }
  if (!merged && !commits_.is_gone()) {
    reports.push_back(commits_.unmerged());
  }
  if (!reports.empty()) {
    report_(std::move(reports));
  }
}

std::vector<WriteReport> GroupCommit::write(std::deque<WriteJob>& jobs) {
  std::vector<WriteReport> reports;
  if (!gone_ && !jobs.empty() && !write_group(jobs, reports)) {
    write_singly(jobs, reports);
  }
  return reports;
}

std::vector<WriteReport> GroupCommit::maintain() {
  std::vector<WriteReport> reports;
  if (gone_) {
    return reports;
  }
  try {
    storage_.check();
  } catch (const StorageGone& error) {
    note_gone(error, reports);
    return reports;
  }
  if (to_be_merged_ && !merge(reports) && ++tries_ == kQuietTries) {
    reports.push_back(unmerged());
  }
  return reports;
}

bool GroupCommit::clear(std::size_t most, std::vector<WriteReport>& reports) {
  try {
    const ClearedAway cleared = storage_.clear_away(most);
    clears_ = cleared != ClearedAway::kAll;
    return cleared != ClearedAway::kMustWait;
  } catch (const StorageGone& error) {
    note_gone(error, reports);
  } catch (const std::exception&) {
    // The next commit reports faults such as a full disk. The next call of `clear` tries again.
  }
  return false;
}

bool GroupCommit::merge(std::vector<WriteReport>& reports) {
  try {
    to_be_merged_ = !storage_.merge_log();
    why_unmerged_ = to_be_merged_ ? "another program is reading the database" : "";
    return !to_be_merged_;
  } catch (const StorageGone& error) {
    note_gone(error, reports);
  } catch (const StorageError& error) {
    why_unmerged_ = error.what();  // no data is lost, because the log remains
  }
  return false;
}

void GroupCommit::note_committed(std::span<const Change> changes) {
  for (const Change& change : changes) {
    const auto* results = std::get_if<AddResults>(&change);
    rows_ += results == nullptr ? 0 : results->results.size();
  }
  clears_ = clears_ || std::any_of(changes.begin(), changes.end(), [](const Change& change) {
              return std::holds_alternative<DeleteStudy>(change);
            });
  if (std::any_of(changes.begin(), changes.end(), ends_a_study)) {
    to_be_merged_ = true;
    tries_ = 0;
  }
}

void GroupCommit::note_gone(const std::exception& error, std::vector<WriteReport>& reports) {
  gone_ = true;
  reports.push_back({WriteReport::Kind::kGone, 0, error.what()});
}

bool GroupCommit::write_group(std::deque<WriteJob>& jobs, std::vector<WriteReport>& reports) {
  std::size_t size = 0;
  // A lookup of reusable results ends the group, because it takes as long as thousands of results.
  for (bool has_lookup = false; size < std::min(jobs.size(), kLargestGroup) && !has_lookup;
       ++size) {
    has_lookup = std::holds_alternative<ReuseResults>(jobs[size].change);
  }
  std::vector<Change> changes;
  changes.reserve(size);
  for (std::size_t i = 0; i < size; ++i) {
    changes.push_back(std::move(jobs[i].change));
  }
  const auto put_back = [&] {
    for (std::size_t i = 0; i < size; ++i) {
      jobs[i].change = std::move(changes[i]);
    }
  };
  try {
    storage_.commit(changes);
  } catch (const StorageGone& error) {
    put_back();
    note_gone(error, reports);
    return true;
  } catch (const std::exception&) {  // catches std::bad_alloc too
    put_back();
    return false;  // `write_singly` then finds the job that fails
  }
  note_committed(changes);
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
  std::set<std::uint64_t> waiting;  // studies with a waiting job
  std::string fault;
  const auto keep = [&](WriteJob& job) {
    waiting.insert(study_of(job.change));
    kept.push_back(std::move(job));
  };
  for (WriteJob& job : jobs) {
    // Changes of one study must keep their order: "done, then retried" must not become "retried,
    // then done". So when a job must wait, all later jobs for which no client waits must wait too.
    // A later job for which a client waits is refused if it changes a study with a waiting job.
    if (gone_ || (!fault.empty() && !job.answer_failure)) {
      keep(job);
      continue;
    }
    if (waiting.contains(study_of(job.change))) {
      reports.push_back({WriteReport::Kind::kRefused, job.ticket, fault});
      continue;
    }
    try {
      storage_.commit({&job.change, 1});
      note_committed({&job.change, 1});
      reports.push_back({WriteReport::Kind::kStored, job.ticket, {}});
    } catch (const StorageGone& error) {
      note_gone(error, reports);
      keep(job);
    } catch (const std::exception& error) {
      if (job.answer_failure) {
        reports.push_back({WriteReport::Kind::kRefused, job.ticket, error.what()});
        continue;
      }
      if (dynamic_cast<const ChangeRefused*>(&error) != nullptr) {  // waiting does not help
        note_gone(error, reports);
      }
      fault = error.what();
      keep(job);
    }
  }
  jobs = std::move(kept);
  if (!gone_ && faulty_ != !fault.empty()) {
    faulty_ = !fault.empty();
    reports.push_back(
        {faulty_ ? WriteReport::Kind::kFault : WriteReport::Kind::kRecovered, 0, fault});
  }
}

}  // namespace oblique::server
