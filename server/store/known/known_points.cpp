#include "server/store/known/known_points.h"

#include <stdexcept>

#include "server/store/rows/settled_runs.h"

namespace oblique::server {
namespace {

/// Bytes of a recipe that are read in the time of a number.
constexpr std::uint64_t kBytesANumber = 8;

std::uint64_t number(const Statement& row, int column) {
  return static_cast<std::uint64_t>(row.integer(column));
}

/// Whether results of the study can be of that version.
bool is_of_version(sqlite3* database, std::uint64_t study_id, const std::string& version) {
  Statement study(database, "SELECT mixes_versions FROM studies WHERE study_id = ?");
  study.bind(1, study_id);
  if (!study.step()) {
    return false;  // it is deleted
  }
  if (study.integer(0) != 0) {
    return true;
  }
  Statement first(database,
                  "SELECT w.solver_version FROM packed_results AS r"
                  " CROSS JOIN workers AS w ON w.worker_id = r.worker"
                  " WHERE r.study_id = ? ORDER BY r.point LIMIT 1");
  first.bind(1, study_id);
  return first.step() && first.text(0) == version;
}

IntervalSet solved_points(sqlite3* database, std::uint64_t study_id, std::uint64_t points) {
  const auto noted = noted_points_of(database, study_id);
  IntervalSet solved = noted ? *noted : points_with_row(database, study_id, {0, points});
  Statement failed(database,
                   "SELECT point FROM packed_results INDEXED BY failed_points WHERE study_id = ?"
                   " AND error IS NOT NULL");
  failed.bind(1, study_id);
  while (failed.step()) {
    solved.erase(number(failed, 0));
  }
  return solved;
}

}  // namespace

bool KnownSource::may_have(const protocol::Recipe& wanted, const PointBox& box, Work& work) {
  if (box_ == nullptr && is_readable_) {
    work.spend(table_.recipe_bytes().size() / kBytesANumber);
    protocol::Recipe recipe;
    is_readable_ = recipe.ParseFromString(table_.recipe_bytes()) && recipe.blocks_size() > 0;
    if (is_readable_) {
      box_ = std::make_unique<PointBox>(box_of(recipe));
      wants_errors_ = recipe.errors();
    }
  }
  return is_readable_ && wants_errors_ == wanted.errors() && !box.is_apart_from(*box_);
}

std::unique_ptr<const protocol::PointTable> KnownSource::points() const {
  protocol::Recipe recipe;
  if (!recipe.ParseFromString(table_.recipe_bytes())) {
    return nullptr;
  }
  try {
    return std::make_unique<const protocol::PointTable>(std::move(recipe));
  } catch (const std::runtime_error&) {
    return nullptr;
  }
}

void find_known(sqlite3* database, const protocol::PointTable& wanted, const IntervalSet& open,
                const KnownSource& source, const std::string& solver_version, Work& work,
                const std::function<void(const SharedRun&)>& take) {
  if (!is_of_version(database, source.study_id(), solver_version)) {
    return;
  }
  const auto table = source.points();
  if (table == nullptr) {
    return;
  }
  work.spend(static_cast<std::uint64_t>(table->recipe().ByteSizeLong()) / kBytesANumber);
  const IntervalSet solved = solved_points(database, source.study_id(), table->size());
  match_recipes(wanted, open, *table, solved, work, take);
}

IntervalSet open_points(sqlite3* database, std::uint64_t study_id, std::uint64_t points) {
  IntervalSet open(0, points);
  if (const auto settled = noted_points_of(database, study_id)) {
    settled->for_each([&](const Interval& run) { open.erase(run.begin, run.end); });
  }
  return open;
}

}  // namespace oblique::server
