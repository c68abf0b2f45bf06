#include "server/store/known/known_finder.h"

#include <algorithm>
#include <exception>
#include <tuple>
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
  void flush() {
    std::sort(runs_.begin(), runs_.end(),
              [](const SharedRun& a, const SharedRun& b) { return a.point < b.point; });
    std::uint64_t points = 0;
    for (SharedRun run : std::exchange(runs_, {})) {
      while (run.count > 0) {
        const std::uint64_t part = std::min(run.count, finder_.settings_.chunk_points - points);
        chunk_.push_back({run.point, run.source_point, part});
        run = {run.point + part, run.source_point + part, run.count - part};
        points += part;
        if (points == finder_.settings_.chunk_points) {
          if (!hand_over()) {
            return;
          }
          points = 0;
        }
      }
    }
    if (!chunk_.empty()) {
      hand_over();
    }
  }
  /// The points that were handed over.
  const IntervalSet& found() const { return found_; }

 private:
  /// What is not handed over at the end of a turn is found again in the next one.
  bool hand_over() {
    std::vector<SharedRun> chunk = std::exchange(chunk_, {});
    if (finder_.is_turn_over() || !finder_.hand_over({study_id_, source_id_, chunk})) {
      return false;
    }
    for (const SharedRun& run : chunk) {
      found_.insert(run.point, run.point + run.count);
    }
    return true;
  }

  KnownFinder& finder_;
  std::uint64_t study_id_;
  std::uint64_t source_id_;
  std::vector<SharedRun> runs_;
  std::vector<SharedRun> chunk_;
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
  waiting_.push_back({std::move(question), {}, 0, 0, ++last_wait_});
  wake_.notify_all();
}

void KnownFinder::set_priority(std::uint64_t study_id, std::int32_t priority) {
  const std::lock_guard lock(mutex_);
  if (current_.question.study_id == study_id) {
    current_.question.priority = priority;
  }
  for (Waiting& waiting : waiting_) {
    if (waiting.question.study_id == study_id) {
      waiting.question.priority = priority;
    }
  }
}

void KnownFinder::go_on() {
  const std::lock_guard lock(mutex_);
  --reports_out_;
  wake_.notify_all();
}

void KnownFinder::stop_seeking(std::uint64_t study_id) {
  const std::lock_guard lock(mutex_);
  if (current_.question.study_id == study_id) {
    is_unwanted_ = true;
    wake_.notify_all();
  }
  // One that waits has nothing to find.
  for (Waiting& waiting : waiting_) {
    if (waiting.question.study_id == study_id) {
      waiting.question.is_unwanted = true;
    }
  }
}

void KnownFinder::run() {
  while (true) {
    {
      std::unique_lock lock(mutex_);
      current_ = {};
      wake_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
      if (stopping_) {
        return;
      }
      current_ = next();
      is_unwanted_ = current_.question.is_unwanted;
    }
    turn_ = {Clock::now(), {}, false, false};
    answer();
  }
}

/// The one that is at turn: one that only has to end, else one of the highest priority.
KnownFinder::Waiting KnownFinder::next() {
  const bool longest_waiting = ++turns_ % 2 == 0;
  const auto rank = [&](const Waiting& waiting) {
    return std::tuple(!waiting.question.is_unwanted, -std::int64_t{waiting.question.priority},
                      longest_waiting ? 0 : waiting.turns,
                      longest_waiting ? 0 : waiting.question.table.size(), waiting.waits_from);
  };
  const auto first =
      std::min_element(waiting_.begin(), waiting_.end(),
                       [&](const Waiting& a, const Waiting& b) { return rank(a) < rank(b); });
  Waiting waiting = std::move(*first);
  waiting_.erase(first);
  return waiting;
}

/// Whether others are at turn.
bool KnownFinder::is_turn_over() {
  if (turn_.is_over) {
    return true;
  }
  const auto past = Clock::now() - turn_.began;
  const auto searched = past - turn_.waited;
  if (past < settings_.turn) {
    return false;
  }
  const bool is_long = searched >= settings_.turn * (std::int64_t{1} << current_.long_turns);
  // What was sought long is taken as long, for the next turn seeks it again.
  const bool is_taken = turn_.waited >= 2 * std::max<Clock::duration>(settings_.turn, searched);
  const std::lock_guard lock(mutex_);
  const std::int32_t priority = current_.question.priority;
  turn_.is_over = std::any_of(waiting_.begin(), waiting_.end(), [&](const Waiting& waiting) {
    return waiting.question.priority > priority ||
           (waiting.question.priority == priority && (is_long || is_taken));
  });
  if (turn_.is_over && is_long && ++current_.long_turns >= settings_.most_turns) {
    turn_.is_cut_short = true;
  }
  return turn_.is_over;
}

void KnownFinder::answer() {
  KnownReport end{current_.question.study_id, 0, {}, true, false};
  try {
    protocol::Recipe recipe;
    if (!is_unwanted_ && recipe.ParseFromString(current_.question.table.recipe_bytes())) {
      Work work(settings_.most_work, is_unwanted_, [this] { return is_turn_over(); });
      seek_in_all(protocol::PointTable(std::move(recipe)), work);
      end.is_cut_short = work.is_spent() || turn_.is_cut_short;
    }
  } catch (const std::exception&) {
    end.is_cut_short = true;  // what is not found is solved
  }
  end_or_wait(std::move(end));
}

void KnownFinder::end_or_wait(KnownReport end) {
  const std::lock_guard lock(mutex_);
  if (stopping_) {
    return;
  }
  if (turn_.is_over && !end.is_cut_short) {
    ++current_.turns;
    current_.waits_from = ++last_wait_;
    current_.question.is_unwanted = is_unwanted_;
    waiting_.push_back(std::move(current_));
  } else {
    report_(std::move(end));
  }
}

void KnownFinder::seek_in_all(const protocol::PointTable& table, Work& work) {
  std::vector<std::shared_ptr<KnownSource>> sources;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, source] : sources_) {
      sources.push_back(source);
    }
  }
  const std::uint64_t study_id = current_.question.study_id;
  IntervalSet open = open_points(database(), study_id, table.size());
  current_.found.for_each([&](const Interval& run) { open.erase(run.begin, run.end); });
  const PointBox box = box_of(table.recipe());
  const bool looks = needs_look(table);
  for (const auto& source : sources) {
    if (open.empty() || turn_.is_over || !work.spend(1)) {
      return;
    }
    if (source->study_id() == study_id || !source->may_have(table.recipe(), box, work)) {
      continue;
    }
    Chunks chunks(*this, study_id, source->study_id());
    find_known(database(), table, open, *source, settings_.solver_version, work,
               [&](const SharedRun& run) {
                 if (looks) {
                   add_sound(table, run, work, chunks);
                 } else {
                   chunks.add(run);
                 }
               });
    chunks.flush();
    chunks.found().for_each([&](const Interval& run) {
      open.erase(run.begin, run.end);
      current_.found.insert(run.begin, run.end);
    });
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
  const auto from = Clock::now();
  std::unique_lock lock(mutex_);
  wake_.wait(lock, [this] { return is_unwanted_ || reports_out_ < kMostReportsOut; });
  turn_.waited += Clock::now() - from;
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
