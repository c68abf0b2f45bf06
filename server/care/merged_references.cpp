#include "server/care/merged_references.h"

#include <cstddef>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/canonical.h"
#include "server/care/row_faults.h"
#include "server/store/rows/model_rows.h"
#include "server/store/rows/row_columns.h"

namespace oblique::server {
namespace {

[[noreturn]] void missing(const char* what, std::int64_t number) {
  throw StorageError(fmt::format(
      "a result names {} {}, which is not there: `oblique check` tells more", what, number));
}

void remember(std::unordered_map<std::int64_t, std::int64_t>& known, std::int64_t in_source,
              std::int64_t in_target) {
  constexpr std::size_t kMostKnown = 65536;
  if (known.size() >= kMostKnown) {
    known.clear();
  }
  known.emplace(in_source, in_target);
}

/// Throws StorageError when the row of a worker is not as it was stored: of all its results nobody
/// would know by which solver they are.
void check_workers(sqlite3* source) {
  Statement damaged(source,
                    "SELECT worker_id FROM workers WHERE checksum IS NOT NULL AND checksum <> " +
                        worker_checksum_sql() + " LIMIT 1");
  if (damaged.step()) {
    throw StorageError(
        fmt::format("worker {} is not as it was stored: `oblique check` tells more, and `oblique "
                    "backup --salvage` saves what can be merged",
                    damaged.integer(0)));
  }
}

/// Throws StorageError when the columns of a model are not those of its definition: the whole would
/// be damaged as well.
void refuse_damaged_models(sqlite3* source) {
  const auto faults = faults_of_models(source, 1);
  if (!faults.empty()) {
    throw StorageError(faults.front() + ": `oblique check` tells more");
  }
}

}  // namespace

MergedModels::MergedModels(sqlite3* source, sqlite3* target)
    : target_(target),
      read_(source, "SELECT definition FROM models WHERE model_id = ?"),
      find_(target, "SELECT model_id FROM models WHERE definition = ?"),
      insert_(target, insert_model_sql()) {
  refuse_damaged_models(source);
}

std::int64_t MergedModels::in_target(std::int64_t in_source) {
  if (const auto known = known_.find(in_source); known != known_.end()) {
    return known->second;
  }
  read_.bind(1, in_source);
  if (!read_.step()) {
    missing("model", in_source);
  }
  const std::string definition = read_.text(0);
  read_.reset();
  find_.bind(1, std::string_view(definition));
  std::int64_t number = find_.step() ? find_.integer(0) : 0;
  find_.reset();
  if (number == 0) {
    bind_model(insert_, protocol::model_of_canonical(definition), definition);
    insert_.run();
    number = sqlite3_last_insert_rowid(target_);
  }
  remember(known_, in_source, number);
  return number;
}

MergedWorkers::MergedWorkers(sqlite3* source, sqlite3* target)
    : target_(target),
      read_(source,
            "SELECT name, threads, solver_version, instruction_set, joined_at FROM workers"
            " WHERE worker_id = ?"),
      insert_(
          target,
          "INSERT INTO workers (worker_id, name, threads, solver_version, instruction_set,"
          " joined_at, checksum) SELECT n, ?1, ?2, ?3, ?4, ?5, row_checksum(n, ?1, ?2, ?3, ?4, ?5)"
          " FROM (SELECT coalesce(max(worker_id), 0) + 1 AS n FROM workers)") {
  check_workers(source);
  Statement all(target,
                "SELECT name, threads, solver_version, instruction_set, joined_at, worker_id"
                " FROM workers");
  while (all.step()) {
    there_.emplace(session_in(all), all.integer(5));
  }
}

std::string MergedWorkers::session_in(const Statement& row) {
  std::string session;
  for (int column = 0; column < 5; ++column) {
    const std::string value = row.text(column);
    session += fmt::format("{} {} ", value.size(), value);
  }
  return session;
}

std::int64_t MergedWorkers::in_target(std::int64_t in_source) {
  if (const auto known = known_.find(in_source); known != known_.end()) {
    return known->second;
  }
  read_.bind(1, in_source);
  if (!read_.step()) {
    missing("worker", in_source);
  }
  const auto [there, is_new] = there_.try_emplace(session_in(read_), 0);
  if (is_new) {
    there->second = insert_session();
  }
  read_.reset();
  known_.emplace(in_source, there->second);
  return there->second;
}

/// The one that `read_` has; gives its number.
std::int64_t MergedWorkers::insert_session() {
  for (int column = 0; column < 5; ++column) {
    insert_.bind_column(column + 1, read_, column);
  }
  insert_.run();
  return sqlite3_last_insert_rowid(target_);
}

MergedTexts::MergedTexts(sqlite3* source, TextNumbers& target)
    : read_(source, "SELECT text, checksum IS NULL OR checksum = " + text_checksum_sql() +
                        " FROM texts WHERE text_id = ?"),
      target_(target) {}

std::int64_t MergedTexts::in_target(std::int64_t in_source) {
  if (const auto known = known_.find(in_source); known != known_.end()) {
    return known->second;
  }
  read_.bind(1, in_source);
  if (!read_.step() || read_.integer(1) == 0) {
    missing("text", in_source);
  }
  const std::int64_t number = target_.number_of(read_.text(0));
  read_.reset();
  remember(known_, in_source, number);
  return number;
}

}  // namespace oblique::server
