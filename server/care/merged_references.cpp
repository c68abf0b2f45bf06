#include "server/care/merged_references.h"

#include <algorithm>
#include <cstddef>

#include <spdlog/fmt/fmt.h>

#include "server/care/row_faults.h"
#include "server/care/table_columns.h"
#include "server/store/rows/row_columns.h"

namespace oblique::server {
namespace {

[[noreturn]] void missing(const char* what, std::int64_t number) {
  throw StorageError(fmt::format(
      "a result names {} {}, which is not there: `oblique check` tells more", what, number));
}

/// The columns of a model but its number, the definition first. What an earlier schema of `source`
/// lacks has its default in `target`.
std::vector<std::string> columns_of_models(sqlite3* source, sqlite3* target) {
  std::vector<std::string> columns{"definition"};
  const auto there = columns_of(source, "models");
  for (const std::string& name : columns_of(target, "models")) {
    const bool is_there = std::find(there.begin(), there.end(), name) != there.end();
    if (is_there && name != "model_id" && name != "definition") {
      columns.push_back(name);
    }
  }
  return columns;
}

std::int64_t highest(sqlite3* target, const std::string& sql) {
  Statement statement(target, sql);
  return statement.step() ? statement.integer(0) : 0;
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
  if (schema_of(source) < kFirstPacked) {
    return;  // without checksums
  }
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
  const auto faults = faults_of_models(source, schema_of(source), 1);
  if (!faults.empty()) {
    throw StorageError(faults.front() + ": `oblique check` tells more");
  }
}

std::string marks(std::size_t count) {
  std::string text = "?";
  for (std::size_t i = 1; i < count; ++i) {
    text += ", ?";
  }
  return text;
}

}  // namespace

MergedModels::MergedModels(sqlite3* source, sqlite3* target)
    : MergedModels(source, target, columns_of_models(source, target)) {}

MergedModels::MergedModels(sqlite3* source, sqlite3* target,
                           const std::vector<std::string>& columns)
    : read_(source, fmt::format("SELECT {} FROM models WHERE model_id = ?",
                                present_values_sql(schema_of(source), "models",
                                                   fmt::format("{}", fmt::join(columns, ", "))))),
      find_(target, "SELECT model_id FROM models WHERE definition = ?"),
      insert_(target, fmt::format("INSERT INTO models (model_id, {}) VALUES ({})",
                                  fmt::join(columns, ", "), marks(columns.size() + 1))),
      last_(highest(target, "SELECT max(model_id) FROM models")) {
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
  find_.bind_column(1, read_, 0);
  std::int64_t number = find_.step() ? find_.integer(0) : 0;
  find_.reset();
  if (number == 0) {
    number = ++last_;
    insert_.bind(1, number);
    for (int column = 0; column < read_.columns(); ++column) {
      insert_.bind_column(column + 2, read_, column);
    }
    insert_.run();
  }
  read_.reset();
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
