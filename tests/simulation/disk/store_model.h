#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/store/store.h"
#include "tests/simulation/world.h"

namespace oblique::simulation {

using server::AddResults;
using server::AddStudy;
using server::AddWorker;
using server::Change;
using server::DeleteStudy;
using server::ForgetFailures;
using server::GrowStudy;
using server::RenameStudy;
using server::SetPriority;
using server::SetStudyState;
using server::StudyState;

/// The study that a change is of.
template <typename Kind>
std::uint64_t study_of(const Kind& change) {
  if constexpr (requires { change.study_id; }) {
    return change.study_id;
  } else {
    return 0;
  }
}

/// What a store gives to a server that starts.
struct Found {
  std::vector<server::StoredStudy> studies;
  std::uint64_t last_study_id = 0;
  std::uint64_t last_worker_id = 0;
  std::uint64_t starts = 0;  ///< of servers, this one included
};

/// What a store must hold after the changes that it was given, kept in the plainest way. The real
/// store is held against it. Throws Violation where they differ.
class StoreModel {
 public:
  using Rows = std::map<std::uint64_t, std::shared_ptr<const protocol::PointResult>>;

  /// The store took these changes. None may be a result for a point that has one.
  void stored(std::span<const server::Change> changes) {
    bool control = false;
    bool writes = false;
    for (const Change& change : changes) {
      control = control || (!std::holds_alternative<AddWorker>(change) &&
                            !std::holds_alternative<AddResults>(change));
      writes = apply(change, now_) || writes;
    }
    // A transaction that changes nothing writes nothing, and so syncs nothing.
    if (control && writes) {
      synced();
    } else if (writes) {
      entries_.push_back({{changes.begin(), changes.end()}, true});
    }
  }
  /// The store refused them: they are not there, but as long as nothing was written in their place
  /// a crash may bring them back, all or none.
  void refused(std::span<const server::Change> changes) {
    ++failed_commits;
    entries_.push_back({{changes.begin(), changes.end()}, false});
  }

  /// A commit with a full sync of something that is not held against this model.
  void synced() {
    synced_ = now_;
    entries_.clear();
  }

  /// What a store holds after a restart must be all that was stored, or, when power was lost, that
  /// without the last commits since the one that was synced. Takes it for the truth.
  void restarted(const Found& found, bool power_was_lost) {
    // Without a loss of power only what was refused since the last commit is in doubt.
    const auto last_stored =
        std::find_if(entries_.rbegin(), entries_.rend(), [](const Entry& e) { return e.stored; });
    auto entry = power_was_lost ? entries_.begin() : last_stored.base();
    Contents state = power_was_lost ? synced_ : now_;
    std::optional<Contents> matching;
    auto came_back = entries_.end();
    std::uint64_t undone = 0;
    const auto consider = [&](const Contents& candidate, std::vector<Entry>::iterator refused_one) {
      if (candidate == found) {
        matching = candidate;
        came_back = refused_one;
        undone = 0;
      }
    };
    consider(state, entries_.end());
    for (; entry != entries_.end(); ++entry) {
      if (entry->stored) {
        apply_all(*entry, state);
        ++undone;
        consider(state, entries_.end());
      } else {
        Contents with_refused = state;
        apply_all(*entry, with_refused);
        consider(with_refused, entry);
      }
    }
    if (!matching) {
      throw Violation("after a restart the store has other contents than were stored");
    }
    undone_commits += undone;
    refused_kept += came_back != entries_.end() ? 1U : 0U;
    now_ = std::move(*matching);
    now_.last_worker_id = found.last_worker_id;
    if (power_was_lost) {
      synced_ = now_;
      entries_.clear();
    } else if (came_back != entries_.end()) {
      // It counts from now on. Others that were refused beside it may still come instead.
      came_back->stored = true;
      std::rotate(came_back, came_back + 1, entries_.end());
    }
  }

  /// The study called `name`, or nullptr.
  const server::StoredStudy* study(const std::string& name) const {
    for (const auto& [id, study] : now_.studies) {
      if (study.name == name) {
        return &study;
      }
    }
    return nullptr;
  }
  const server::StoredStudy* study(std::uint64_t study_id) const {
    const auto found = now_.studies.find(study_id);
    return found == now_.studies.end() ? nullptr : &found->second;
  }
  const Rows& rows(std::uint64_t study_id) const {
    static const Rows kNone;
    const auto found = now_.rows.find(study_id);
    return found == now_.rows.end() ? kNone : found->second;
  }

  std::uint64_t failed_commits = 0;
  std::uint64_t undone_commits = 0;  ///< that losing power undid
  std::uint64_t refused_kept = 0;    ///< that failed and were there after a crash

 private:
  struct Contents {
    std::map<std::uint64_t, server::StoredStudy> studies;
    std::map<std::uint64_t, Rows> rows;
    std::uint64_t last_study_id = 0;  ///< of deleted ones too
    std::uint64_t last_worker_id = 0;
    bool has_deleted = false;  ///< then rows of workers may be gone, the last one's too

    bool operator==(const Found& found) const {
      return last_study_id == found.last_study_id &&
             (last_worker_id == found.last_worker_id ||
              (has_deleted && found.last_worker_id < last_worker_id)) &&
             std::equal(studies.begin(), studies.end(), found.studies.begin(), found.studies.end(),
                        [](const auto& entry, const server::StoredStudy& there) {
                          const server::StoredStudy& here = entry.second;
                          return here.study_id == there.study_id && here.name == there.name &&
                                 here.state == there.state && here.created_at == there.created_at &&
                                 here.priority == there.priority &&
                                 here.completed == there.completed &&
                                 here.failures == there.failures &&
                                 here.left_out == there.left_out &&
                                 here.table->recipe().SerializeAsString() ==
                                     there.table->recipe().SerializeAsString();
                        });
    }
  };
  struct Entry {
    std::vector<server::Change> changes;
    bool stored;
  };
  /// Says whether anything had to be written.
  static bool apply(const server::Change& change, Contents& contents) {
    if (const auto* study = std::get_if<AddStudy>(&change)) {
      contents.last_study_id = std::max(contents.last_study_id, study->study_id);
      server::StoredStudy& added = contents.studies[study->study_id];
      added.study_id = study->study_id;
      added.name = study->name;
      added.table = study->table;
      added.created_at = study->created_at;
      added.priority = study->priority;
      return true;
    }
    if (const auto* worker = std::get_if<AddWorker>(&change)) {
      contents.last_worker_id = std::max(contents.last_worker_id, worker->worker_id);
      return true;
    }
    const std::uint64_t id = std::visit([](const auto& of) { return study_of(of); }, change);
    const auto known = contents.studies.find(id);
    if (known == contents.studies.end()) {
      return false;  // results of a deleted study are dropped
    }
    server::StoredStudy& study = known->second;
    if (const auto* state = std::get_if<SetStudyState>(&change)) {
      study.state = state->state;
    } else if (const auto* priority = std::get_if<SetPriority>(&change)) {
      return std::exchange(study.priority, priority->priority) != priority->priority;
    } else if (const auto* name = std::get_if<RenameStudy>(&change)) {
      study.name = name->name;
    } else if (const auto* growth = std::get_if<GrowStudy>(&change)) {
      study.table = growth->table;
      study.priority = growth->priority;
      study.state = StudyState::kRunning;
    } else if (std::holds_alternative<DeleteStudy>(change)) {
      contents.studies.erase(known);
      contents.rows.erase(id);
      contents.has_deleted = true;
    } else if (const auto* forget = std::get_if<ForgetFailures>(&change)) {
      return apply(*forget, study, contents.rows[id]);
    } else {
      return apply(std::get<AddResults>(change), study, contents.rows[id]);
    }
    return true;
  }
  static bool apply(const server::AddResults& change, server::StoredStudy& study, Rows& rows) {
    for (const auto& result : change.results) {
      auto row = std::make_shared<const protocol::PointResult>(result);
      if (!rows.emplace(result.point(), std::move(row)).second) {
        throw Violation("point " + std::to_string(result.point()) + " was stored twice");
      }
      study.completed.insert(result.point());
      if (!result.error().empty()) {
        study.failures.insert(result.point());
      }
    }
    change.left_out.for_each([&](const server::Interval& points) {
      if (!study.completed.within(points.begin, points.end).empty()) {
        throw Violation("a filter leaves out points that were completed before");
      }
      study.completed.insert(points.begin, points.end);
      study.left_out += points.end - points.begin;
    });
    return !change.results.empty() || !change.left_out.empty();
  }
  static bool apply(const server::ForgetFailures& change, server::StoredStudy& study, Rows& rows) {
    bool changes = study.state == StudyState::kDone;
    study.state = changes ? StudyState::kRunning : study.state;
    change.points.for_each([&](const server::Interval& interval) {
      for (std::uint64_t point = interval.begin; point < interval.end; ++point) {
        if (study.failures.contains(point)) {
          rows.erase(point);
          study.failures.erase(point);
          study.completed.erase(point);
          changes = true;
        }
      }
    });
    return changes;
  }
  static void apply_all(const Entry& entry, Contents& contents) {
    for (const Change& change : entry.changes) {
      apply(change, contents);
    }
  }

  Contents now_;
  Contents synced_;             // at the last commit with a full sync
  std::vector<Entry> entries_;  // what came since, in order
};

}  // namespace oblique::simulation
