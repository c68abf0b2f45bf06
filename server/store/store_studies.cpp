#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/store/schema.h"
#include "server/store/store.h"

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

constexpr const char* kStudies =
    "SELECT study_id, name, recipe, points, state, created_at, priority,"
    " coalesce(submitted_by, ''), reuses, left_out,"
    " coalesce((SELECT w.solver_version FROM results AS r CROSS JOIN workers AS w USING (worker_id)"
    " WHERE r.study_id = s.study_id ORDER BY r.point LIMIT 1), ''), uid FROM studies AS s"
    " ORDER BY study_id";

StoredStudy study_in(const Statement& row) {
  StoredStudy study{};
  study.study_id = row.number(0);
  study.name = row.text(1);
  study.table = StudyTable(row.text(2), row.number(3));
  study.state = state_named(row.text(4));
  study.created_at = row.text(5);
  study.priority = static_cast<std::int32_t>(row.integer(6));
  study.submitted_by = row.text(7);
  study.reuses = row.integer(8) != 0;
  study.left_out = row.number(9);
  study.solver_version = row.text(10);
  study.uid = row.text(11);
  return study;
}

/// Throws StorageError if a study was changed so that its rows may belong to other points.
void check_studies(sqlite3* database) {
  Statement wrong(database, fmt::format("SELECT study_id, name FROM studies WHERE checksum <> {}",
                                        kStudyChecksum));
  if (wrong.step()) {
    throw StorageError(fmt::format(
        "study {0} (\"{1}\") is damaged or was changed by another program: its number, recipe or "
        "size differs from the stored one, so its results may belong to other points. `oblique "
        "check --db FILE` lists all faults. While no server runs, restore the old values with "
        "sqlite3, delete the study (`oblique delete`), or keep the change (UPDATE studies SET "
        "checksum = NULL WHERE study_id = {0})",
        wrong.integer(0), protocol::visible(wrong.text(1))));
  }
}

/// Returns why this version refuses the study, or "". Sets `is_readable` to false if not even its
/// stored results can be shown. Throws StorageError for an unreadable recipe of a running study;
/// `oblique backup --salvage` leaves no such study.
std::string study_error(const StoredStudy& study, bool& is_readable) {
  is_readable = protocol::is_utf8(study.name);  // the name is part of messages
  if (!is_readable) {
    return "its name is not UTF-8: rename it with sqlite3 while no server runs";
  }
  try {
    (void)study.table.get();
  } catch (const solver::InputError& reason) {
    return reason.what();
  } catch (const std::runtime_error& reason) {
    if (study.state != StudyState::kRunning) {
      is_readable = false;
      return fmt::format("its recipe cannot be read: {}; `oblique delete` removes it",
                         reason.what());
    }
    throw StorageError(fmt::format(
        "the recipe of study {} cannot be read: {}. `oblique check --db FILE` lists all faults",
        study.name, reason.what()));
  }
  return {};
}

void read_failures(sqlite3* database, std::vector<StoredStudy>& studies) {
  std::map<std::uint64_t, StoredStudy*> by_number;
  for (StoredStudy& study : studies) {
    by_number[study.study_id] = &study;
  }
  Statement row(database,
                "SELECT study_id, point FROM results INDEXED BY failed_points"
                " WHERE error IS NOT NULL ORDER BY study_id, point");
  while (row.step()) {
    const auto study = by_number.find(row.number(0));
    if (study != by_number.end()) {
      study->second->failures.insert(row.number(1));
    }
  }
}

}  // namespace

std::vector<StoredStudy> Store::studies() {
  check_studies(database_.get());
  std::vector<StoredStudy> found;
  skipped_.clear();
  Statement list(database_.get(), kStudies);
  Statement reused(database_.get(), "SELECT source, points FROM reused_points WHERE study_id = ?");
  while (list.step()) {
    StoredStudy study = study_in(list);
    study.completed = completed_points(database_.get(), study.study_id);
    reused.bind_all(study.study_id);
    while (reused.step()) {
      study.reused[reused.text(0)] = reused.number(1);
    }
    reused.reset();
    const bool is_open = study.completed.size() < study.table.size();
    bool is_readable = true;
    const std::string error = study_error(study, is_readable);
    if (!error.empty() && (is_open || !is_readable)) {
      skipped_.push_back(fmt::format("study {} (\"{}\") is skipped: {}", study.study_id,
                                     protocol::visible(study.name), error));
      continue;
    }
    if (!is_open || study.state != StudyState::kRunning) {
      study.table.release();  // the table of points is made again when the study runs
    }
    found.push_back(std::move(study));
  }
  read_failures(database_.get(), found);
  return found;
}

std::uint64_t Store::number(const std::string& sql) {
  Statement statement(database_.get(), sql);
  return statement.step() ? statement.number(0) : 0;
}

std::uint64_t Store::last_study_id() {
  return number(fmt::format("SELECT {}", kLastStudyId));
}

std::uint64_t Store::last_worker_id() {
  return number("SELECT max(worker_id) FROM workers");
}

std::uint64_t Store::count_start() {
  write([this] { execute(database_.get(), "UPDATE about SET starts = starts + 1"); });
  return number("SELECT starts FROM about");
}

std::string Store::database_id() {
  Statement statement(database_.get(), "SELECT database_id FROM about");
  if (!statement.step()) {
    throw StorageError("the database has no ID: the table about is empty");
  }
  return statement.text(0);
}

}  // namespace oblique::server
