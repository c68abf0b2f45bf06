// Reading back what studies there are and how far they are.
#include <stdexcept>
#include <string>
#include <utility>

#include "server/store.h"

namespace oblique::server {
namespace {

StudyState state_named(const std::string& name) {
  for (const StudyState state : {StudyState::kDone, StudyState::kCancelled, StudyState::kPaused}) {
    if (name == state_name(state)) {
      return state;
    }
  }
  return StudyState::kRunning;
}

/// The points, in order, that a query over one study gives.
IntervalSet points_of(Statement& query, std::uint64_t study_id) {
  IntervalSet points;
  Interval run{0, 0};
  query.reset();
  query.bind(1, study_id);
  while (query.step()) {
    const auto point = static_cast<std::uint64_t>(query.integer(0));
    if (point != run.end) {
      points.insert(run.begin, run.end);
      run.begin = point;
    }
    run.end = point + 1;
  }
  points.insert(run.begin, run.end);
  query.reset();
  return points;
}

}  // namespace

std::vector<StoredStudy> Store::studies() {
  std::vector<StoredStudy> found;
  Statement list(database_.get(),
                 "SELECT study_id, name, recipe, state, created_at, priority, weight,"
                 " mixes_versions FROM studies ORDER BY study_id");
  Statement version(database_.get(),
                    "SELECT solver_version FROM results WHERE study_id = ?"
                    " AND solver_version IS NOT NULL ORDER BY point LIMIT 1");
  Statement settled(database_.get(), "SELECT point FROM results WHERE study_id = ? ORDER BY point");
  Statement failed(database_.get(),
                   "SELECT point FROM results WHERE study_id = ? AND status = 'failed'"
                   " ORDER BY point");
  while (list.step()) {
    StoredStudy study{};
    study.study_id = static_cast<std::uint64_t>(list.integer(0));
    study.name = list.text(1);
    study.state = state_named(list.text(3));
    study.created_at = list.text(4);
    study.share = {static_cast<std::int32_t>(list.integer(5)), list.real(6), list.integer(7) != 0};
    protocol::Recipe recipe;
    try {
      if (!recipe.ParseFromString(list.text(2))) {
        throw StorageError("its bytes are damaged");
      }
      study.table = std::make_shared<const protocol::PointTable>(std::move(recipe));
    } catch (const solver::InputError& reason) {
      left_out_.push_back(
          "the study \"" + study.name +
          "\" is left as it is, for this version takes no such study: " + reason.what());
      continue;
    } catch (const std::runtime_error& reason) {
      throw StorageError("the recipe of study " + study.name + " cannot be read: " + reason.what());
    }
    version.reset();
    version.bind(1, study.study_id);
    study.solver_version = version.step() ? version.text(0) : "";
    version.reset();
    study.settled = points_of(settled, study.study_id);
    study.failures = points_of(failed, study.study_id);
    study.attempts = attempts_of(study.study_id);
    found.push_back(std::move(study));
  }
  return found;
}

AttemptRuns Store::attempts_of(std::uint64_t study_id) {
  AttemptRuns attempts;
  // The failures that are there come last: they are later than all that were forgotten.
  for (const char* sql :
       {"SELECT first_point, points, attempt FROM retries WHERE study_id = ? ORDER BY rowid",
        "SELECT point, 1, attempt FROM results WHERE study_id = ? AND status = 'failed'"}) {
    Statement counted(database_.get(), sql);
    counted.bind(1, study_id);
    while (counted.step()) {
      const auto first = static_cast<std::uint64_t>(counted.integer(0));
      attempts.set({first, first + static_cast<std::uint64_t>(counted.integer(1))},
                   static_cast<std::uint32_t>(counted.integer(2)));
    }
  }
  return attempts;
}

}  // namespace oblique::server
