#include "server/store/known/known_finder.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "proto/recipe/point_table.h"
#include "server/database/open_for_reading.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostReportsOut = 2;
/// Runs that are sorted together, so that points come nearly in their order.
constexpr std::size_t kSortedRuns = std::size_t{1} << 18U;

}  // namespace

/// Gathers the runs of one source, and hands them over in parts of about one size.
class KnownFinder::Chunks {
 public:
  Chunks(KnownFinder& finder, std::uint64_t study_id, std::uint64_t source_id)
      : finder_(finder), study_id_(study_id), source_id_(source_id) {}

  void add(const SharedRun& run) {
    if (!runs_.empty() && runs_.back().point + runs_.back().count == run.point &&
        runs_.back().source_point + runs_.back().count == run.source_point) {
      runs_.back().count += run.count;
      return;
    }
    runs_.push_back(run);
    if (runs_.size() == kSortedRuns) {
      flush();
    }
  }
  /// The points that were found.
  void flush() {
    std::sort(runs_.begin(), runs_.end(),
              [](const SharedRun& a, const SharedRun& b) { return a.point < b.point; });
    std::vector<SharedRun> chunk;
    std::uint64_t points = 0;
    for (SharedRun run : runs_) {
      found_.insert(run.point, run.point + run.count);
      while (run.count > 0) {
        const std::uint64_t part = std::min(run.count, finder_.settings_.chunk_points - points);
        chunk.push_back({run.point, run.source_point, part});
        run = {run.point + part, run.source_point + part, run.count - part};
        points += part;
        if (points == finder_.settings_.chunk_points) {
          if (!finder_.hand_over({study_id_, source_id_, std::exchange(chunk, {})})) {
            return;
          }
          points = 0;
        }
      }
    }
    if (!chunk.empty()) {
      finder_.hand_over({study_id_, source_id_, std::move(chunk)});
    }
    runs_.clear();
  }
  const IntervalSet& found() const { return found_; }

 private:
  KnownFinder& finder_;
  std::uint64_t study_id_;
  std::uint64_t source_id_;
  std::vector<SharedRun> runs_;
  IntervalSet found_;
};

KnownFinder::KnownFinder(KnownFinderSettings settings, Report report)
    : settings_(std::move(settings)), report_(std::move(report)), thread_([this] { run(); }) {}

KnownFinder::~KnownFinder() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    is_unwanted_ = true;
    wake_.notify_all();
  }
  thread_.join();
}

void KnownFinder::note_source(std::uint64_t study_id, const StudyTable& table) {
  const std::lock_guard lock(mutex_);
  sources_[study_id] = std::make_shared<KnownSource>(study_id, table);
}

void KnownFinder::drop_source(std::uint64_t study_id) {
  const std::lock_guard lock(mutex_);
  sources_.erase(study_id);
}

void KnownFinder::seek(KnownQuestion question) {
  const std::lock_guard lock(mutex_);
  questions_.push_back(std::move(question));
  wake_.notify_all();
}

void KnownFinder::go_on() {
  const std::lock_guard lock(mutex_);
  --reports_out_;
  wake_.notify_all();
}

void KnownFinder::stop_seeking(std::uint64_t study_id) {
  const std::lock_guard lock(mutex_);
  if (current_ == study_id) {
    is_unwanted_ = true;
    wake_.notify_all();
    return;
  }
  // One that waits has nothing to find.
  for (KnownQuestion& question : questions_) {
    if (question.study_id == study_id) {
      question.is_unwanted = true;
    }
  }
}

void KnownFinder::run() {
  while (true) {
    KnownQuestion question{};
    {
      std::unique_lock lock(mutex_);
      current_ = 0;
      wake_.wait(lock, [this] { return stopping_ || !questions_.empty(); });
      if (stopping_) {
        return;
      }
      question = std::move(questions_.front());
      questions_.pop_front();
      current_ = question.study_id;
      is_unwanted_ = false;
    }
    answer(question);
  }
}

void KnownFinder::answer(const KnownQuestion& question) {
  KnownReport end{question.study_id, 0, {}, true, false};
  try {
    protocol::Recipe recipe;
    if (!question.is_unwanted && recipe.ParseFromString(question.table.recipe_bytes())) {
      Work work(settings_.most_work, is_unwanted_);
      seek_in_all(question, protocol::PointTable(std::move(recipe)), work);
      end.is_cut_short = work.is_spent();
    }
  } catch (const std::exception&) {
    end.is_cut_short = true;  // what is not found is solved
  }
  const std::lock_guard lock(mutex_);
  if (!stopping_) {
    report_(std::move(end));
  }
}

void KnownFinder::seek_in_all(const KnownQuestion& question, const protocol::PointTable& table,
                              Work& work) {
  std::vector<std::shared_ptr<KnownSource>> sources;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, source] : sources_) {
      sources.push_back(source);
    }
  }
  IntervalSet open = open_points(database(), question.study_id, table.size());
  const PointBox box = box_of(table.recipe());
  const bool looks = needs_look(table);
  for (const auto& source : sources) {
    if (open.empty() || !work.spend(1)) {
      return;
    }
    if (source->study_id() == question.study_id || !source->may_have(table.recipe(), box, work)) {
      continue;
    }
    Chunks chunks(*this, question.study_id, source->study_id());
    find_known(database(), table, open, *source, settings_.solver_version, work,
               [&](const SharedRun& run) {
                 if (looks) {
                   add_sound(table, run, work, chunks);
                 } else {
                   chunks.add(run);
                 }
               });
    chunks.flush();
    chunks.found().for_each([&](const Interval& run) { open.erase(run.begin, run.end); });
  }
}

/// Those of the run that a filter leaves in and that can be solved.
void KnownFinder::add_sound(const protocol::PointTable& table, const SharedRun& run, Work& work,
                            Chunks& chunks) {
  for (std::uint64_t i = 0; i < run.count && work.spend(1); ++i) {
    if (table.is_left_in(run.point + i) && table.fault(run.point + i).empty()) {
      chunks.add({run.point + i, run.source_point + i, 1});
    }
  }
}

/// False when nobody wants it any more.
bool KnownFinder::hand_over(KnownReport report) {
  std::unique_lock lock(mutex_);
  wake_.wait(lock, [this] { return is_unwanted_ || reports_out_ < kMostReportsOut; });
  if (is_unwanted_) {
    return false;
  }
  ++reports_out_;
  report_(std::move(report));
  return true;
}

sqlite3* KnownFinder::database() {
  if (database_ == nullptr) {
    database_ = open_for_reading(settings_.database).database;
  }
  return database_.get();
}

}  // namespace oblique::server
