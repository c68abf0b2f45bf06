#include "server/store/schema/standing_views.h"

#include <algorithm>
#include <iterator>
#include <random>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
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

/// What `sql` finds in a new database.
std::vector<Standing> in_new_database(const std::string& sql) {
  const DatabaseHandle database = open_database(":memory:", SQLITE_OPEN_READWRITE);
  for (const char* part : {kSchemaSql, kResultsSql, kViewsSql}) {
    execute(database.get(), part);
  }
  return standing_in(database.get(), sql);
}

/// Those of a new database, in an order in which they can be made.
const std::vector<Standing>& ours() {
  static const std::vector<Standing> all = in_new_database(kStandingSql);
  return all;
}

enum class State { kSound, kMissing, kOther, kNameTaken };

State state_of(sqlite3* database, const Standing& one) {
  // Triggers have names of their own: a table may be called as one is.
  Statement find(database,
                 "SELECT type, sql FROM sqlite_schema WHERE name = ?1 COLLATE NOCASE"
                 " AND (type = 'trigger') = (?2 = 'trigger')");
  find.bind(1, one.name);
  find.bind(2, one.type);
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

/// Names of the triggers that this schema does not have.
std::vector<std::string> other_triggers(sqlite3* database) {
  constexpr std::size_t kLongestName = 80;
  std::vector<std::string> names;
  for (const Standing& one : standing_in(database, kStandingSql)) {
    const bool is_ours = std::ranges::any_of(ours(), [&](const Standing& other) {
      return other.type == one.type && other.name == one.name && other.table == one.table;
    });
    if (one.type == "trigger" && !is_ours) {
      names.push_back(protocol::visible(protocol::shortened(one.name, kLongestName)));
    }
  }
  return names;
}

std::string random_id() {
  std::random_device source;
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string id;
  for (int i = 0; i < 32; ++i) {
    id += kDigits[source() % kDigits.size()];
  }
  return id;
}

}  // namespace

void create_schema(sqlite3* database) {
  Transaction transaction(database);
  for (const char* part : {kSchemaSql, kResultsSql, kViewsSql}) {
    execute(database, part);
  }
  execute(database, "PRAGMA application_id = " + std::to_string(kApplicationId));
  execute(database, "PRAGMA user_version = " + std::to_string(kSchemaVersion));
  Statement about(database, "INSERT INTO about (database_id) VALUES (?)");
  about.bind(1, random_id());
  about.run();
  transaction.commit();
}

const std::vector<std::string>& our_tables() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> found;
    for (const Standing& table :
         in_new_database("SELECT type, name, tbl_name, sql FROM sqlite_schema"
                         " WHERE type = 'table' AND name NOT LIKE 'sqlite_%' ORDER BY name")) {
      found.push_back(table.name);
    }
    return found;
  }();
  return names;
}

std::vector<std::string> missing_tables(sqlite3* database) {
  std::vector<std::string> missing;
  Statement find(database,
                 "SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ? COLLATE NOCASE");
  for (const std::string& name : our_tables()) {
    find.bind(1, name);
    if (!find.step()) {
      missing.push_back(name);
    }
    find.reset();
  }
  return missing;
}

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
  for (const std::string& name : other_triggers(database)) {
    faults.push_back(fmt::format(
        "the trigger {} is not ours: no server works on this file until it is dropped", name));
  }
  return faults;
}

std::vector<std::string> missing_views(sqlite3* database) {
  std::vector<std::string> names;
  for (const Standing& one : that_are(database, State::kMissing)) {
    if (one.type == "view") {
      names.push_back(one.name);
    }
  }
  return names;
}

void refuse_other_triggers(sqlite3* database, const std::string& path) {
  constexpr std::size_t kMostNames = 10;
  std::vector<std::string> names = other_triggers(database);
  if (names.empty()) {
    return;
  }
  const std::size_t more = names.size() - std::min(names.size(), kMostNames);
  names.resize(names.size() - more);
  throw StorageError(fmt::format(
      "{} has triggers that are not ours, and would run with each change of its rows: {}{}. Drop "
      "them, as with DROP TRIGGER in the program sqlite3",
      path, fmt::join(names, ", "), more > 0 ? fmt::format(" and {} more", more) : ""));
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

}  // namespace oblique::server
