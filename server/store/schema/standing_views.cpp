#include "server/store/schema/standing_views.h"

#include <algorithm>
#include <iterator>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "server/store/schema/schema.h"

namespace oblique::server {
namespace {

/// A view, trigger or index.
struct Standing {
  std::string type;
  std::string name;
  std::string table;  ///< or view to which it belongs
  std::string sql;
};

constexpr const char* kStandingSql =
    "SELECT type, name, tbl_name, sql FROM sqlite_schema"
    " WHERE type IN ('view', 'trigger', 'index') AND sql IS NOT NULL ORDER BY rowid";

std::vector<Standing> standing_in(sqlite3* database, const std::string& sql) {
  std::vector<Standing> found;
  Statement statement(database, sql);
  while (statement.step()) {
    found.push_back({statement.text(0), statement.text(1), statement.text(2), statement.text(3)});
  }
  return found;
}

/// Those of a new database, in an order in which they can be made.
const std::vector<Standing>& ours() {
  static const std::vector<Standing> all = [] {
    const DatabaseHandle database = open_database(":memory:", SQLITE_OPEN_READWRITE);
    for (const char* sql : {kSchemaSql, kResultsSql, kViewsSql}) {
      execute(database.get(), sql);
    }
    return standing_in(database.get(), kStandingSql);
  }();
  return all;
}

enum class State { kSound, kMissing, kOther, kNameTaken };

State state_of(sqlite3* database, const Standing& one) {
  Statement find(database, "SELECT type, sql FROM sqlite_schema WHERE name = ? COLLATE NOCASE");
  find.bind(1, one.name);
  State state = State::kMissing;
  if (find.step()) {
    if (find.text(0) != one.type) {
      state = State::kNameTaken;
    } else {
      // How an index was written says nothing of what it is.
      state = one.type == "index" || find.text(1) == one.sql ? State::kSound : State::kOther;
    }
  }
  find.reset();
  return state;
}

std::vector<Standing> that_are(sqlite3* database, State state) {
  std::vector<Standing> found;
  std::copy_if(ours().begin(), ours().end(), std::back_inserter(found),
               [&](const Standing& one) { return state_of(database, one) == state; });
  return found;
}

std::string names_of(const std::vector<Standing>& some) {
  std::string names;
  for (const Standing& one : some) {
    names += fmt::format("{}{} {}", names.empty() ? "" : ", ", one.type, one.name);
  }
  return names;
}

std::string name_taken(const Standing& one) {
  return fmt::format(
      "the {0} {1} cannot be there, for something else has its name: call that otherwise, and the "
      "next server makes the {0}",
      one.type, one.name);
}

/// Triggers of the views, but for ours, which go when a view does.
std::vector<Standing> added_triggers(sqlite3* database, const std::vector<Standing>& views) {
  std::vector<Standing> added = standing_in(database, kStandingSql);
  std::erase_if(added, [&](const Standing& one) {
    const auto has_name = [&](const Standing& other) { return other.name == one.name; };
    return one.type != "trigger" || std::any_of(ours().begin(), ours().end(), has_name) ||
           std::none_of(views.begin(), views.end(),
                        [&](const Standing& view) { return view.name == one.table; });
  });
  return added;
}

}  // namespace

std::vector<std::string> faults_of_views(sqlite3* database) {
  std::vector<std::string> faults;
  for (const Standing& one : ours()) {
    switch (state_of(database, one)) {
      case State::kSound:
        break;
      case State::kMissing:
        faults.push_back(
            fmt::format("the {} {} is missing: the next server on this file makes it again",
                        one.type, one.name));
        break;
      case State::kOther:
        faults.push_back(fmt::format(
            "the {} {} is not ours: the next server on this file makes ours again; give yours "
            "another name",
            one.type, one.name));
        break;
      case State::kNameTaken:
        faults.push_back(name_taken(one));
    }
  }
  return faults;
}

std::vector<std::string> missing_views(sqlite3* database) {
  std::vector<std::string> names;
  Statement schema(database, "PRAGMA user_version");
  if (!schema.step() || schema.integer(0) != kSchemaVersion) {
    return names;
  }
  schema.reset();
  for (const Standing& one : that_are(database, State::kMissing)) {
    if (one.type == "view") {
      names.push_back(one.name);
    }
  }
  return names;
}

bool restore_views(sqlite3* database, const std::function<void(const std::string&)>& notice) {
  const auto tell = [&](const std::string& sentence) {
    if (notice) {
      notice(sentence);
    }
  };
  for (const Standing& one : that_are(database, State::kNameTaken)) {
    tell(name_taken(one));
  }
  const std::vector<Standing> other = that_are(database, State::kOther);
  const std::vector<Standing> missing = that_are(database, State::kMissing);
  if (other.empty() && missing.empty()) {
    return false;
  }
  Transaction transaction(database);
  const std::vector<Standing> added = added_triggers(database, other);
  for (const Standing& one : other) {
    execute(database, fmt::format("DROP {} IF EXISTS {}", one.type, one.name));
  }
  for (const Standing& one : that_are(database, State::kMissing)) {
    execute(database, one.sql);
    if (one.type == "trigger" && one.table == "packed_results") {
      // Nobody has noted meanwhile what other programs deleted.
      execute(database, "UPDATE studies SET counted = 0");
    }
  }
  for (const Standing& trigger : added) {
    try {
      execute(database, trigger.sql);
    } catch (const StorageError& error) {
      tell(fmt::format("the trigger {} on {} cannot be kept: {}", trigger.name, trigger.table,
                       error.what()));
    }
  }
  transaction.commit();
  if (!missing.empty()) {
    tell(fmt::format("made again, for they were missing: {}", names_of(missing)));
  }
  if (!other.empty()) {
    tell(
        fmt::format("made again, for they were not as this version has them: {}", names_of(other)));
  }
  return true;
}

void shadow_views(sqlite3* database) {
  constexpr std::string_view kCreate = "CREATE VIEW ";
  for (const Standing& one : ours()) {
    if (one.type == "view" && one.sql.starts_with(kCreate)) {
      execute(database, "CREATE TEMP VIEW " + one.sql.substr(kCreate.size()));
    }
  }
}

}  // namespace oblique::server
