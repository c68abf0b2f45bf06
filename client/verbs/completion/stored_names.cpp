#include "client/verbs/completion/stored_names.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <exception>
#include <memory>

#include <spdlog/fmt/fmt.h>

#include "client/service/connection.h"
#include "server/database/open_for_reading.h"
#include "server/database/sqlite.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;

/// As many as anybody reads.
constexpr int kMostNames = 500;
/// Of a database, which answers in less unless it is meant to take long.
constexpr std::chrono::milliseconds kLongestRead{50};

/// Since this process began, or less: it has not waited for anything so far.
std::chrono::milliseconds spent_so_far() {
  return std::chrono::milliseconds(std::clock() * 1000 / CLOCKS_PER_SEC);
}

std::string text_of_sql(const std::string& text) {
  std::string literal = "'";
  for (const char c : text) {
    literal += c == '\'' ? "''" : std::string(1, c);
  }
  return literal + "'";
}

/// Names are found by their index. No name has a byte above those of UTF-8.
std::string statement(const std::string& begin) {
  const std::string fits = fmt::format(
      "FROM studies WHERE name >= {0} AND name < {0} || char(1114111)", text_of_sql(begin));
  return fmt::format(
      "SELECT name FROM (SELECT name {0} ORDER BY name LIMIT {1}) UNION SELECT max(name) {0} "
      "ORDER BY name",
      fits, kMostNames);
}

int has_taken_too_long(void* end) {
  return Clock::now() > *static_cast<const Clock::time_point*>(end) ? 1 : 0;
}

}  // namespace

std::chrono::milliseconds patience_left(std::chrono::milliseconds spent) {
  constexpr std::chrono::milliseconds kUntilItEnds{18};  // the rest: to tell it, and to end
  constexpr std::chrono::milliseconds kLeast{4};
  return std::max(kUntilItEnds - spent, kLeast);
}

std::vector<std::string> names_in_database(const std::string& file, const std::string& begin) {
  std::vector<std::string> names;
  try {
    auto end = Clock::now() + kLongestRead;
    const auto database = server::open_without_traces(file);
    constexpr int kSteps = 1000;
    sqlite3_progress_handler(database.get(), kSteps, has_taken_too_long, &end);
    server::Statement rows(database.get(), statement(begin));
    while (rows.step()) {
      if (!rows.is_null(0)) {
        names.push_back(rows.text(0));
      }
    }
  } catch (const std::exception&) {
    // No database, none of ours, or a busy one.
  }
  return names;
}

std::vector<std::string> names_at_server(const SourceFlags& flags, const std::string& begin) {
  std::vector<std::string> names;
  try {
    auto settings = connection_settings(flags);
    const auto patience = patience_left(spent_so_far());
    settings.timeout_ms = patience.count();
    settings.waits_for_server = false;
    Clock::time_point end;
    // Not closed: a name that is looked up somewhere would be waited for. The program ends next.
    auto* connection = new Connection(settings, [&end] { return Clock::now() < end; });
    end = Clock::now() + patience;  // the server's own
    const auto answer = connection->query(statement(begin));
    for (const auto& row : answer.rows()) {
      if (row.values(0).has_text()) {
        names.push_back(row.values(0).text());
      }
    }
  } catch (const std::exception&) {
    // Nobody is there, or does not let us in.
  }
  return names;
}

}  // namespace oblique::client
