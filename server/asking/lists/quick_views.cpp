#include "server/asking/lists/quick_views.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/asking/sql/sql_items.h"
#include "server/asking/sql/sql_tokens.h"
#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

/// A list of the view `results`, the packed column without which it is NULL, and what gives it
/// where it is packed as usual.
struct QuickList {
  std::string_view name;
  std::string_view needs;
  std::string_view quick;
};
constexpr std::array<QuickList, 5> kQuickLists{
    {{"peaks", "p.peaks", "unpacked_peaks(p.peaks)"},
     {"ft_peaks", "p.peaks",
      "CASE WHEN p.ft_peaks IS NOT NULL THEN unpacked_pairs(p.ft_peaks, 2, 1, 12, 5) "
      "ELSE unpacked_pairs(p.peaks, 3, 2, 12, 5) END"},
     {"phases", "p.peaks", "unpacked_phases(p.phases, p.duration)"},
     {"stick_intervals", "p.stick_intervals", "unpacked_pairs(p.stick_intervals, 2, 1, 12, 12)"},
     {"reaction_peaks", "p.reaction_peaks", "unpacked_pairs(p.reaction_peaks, 2, 1, 12, 5)"}}};

std::string view_in_file(sqlite3* database, const char* name) {
  Statement view(database, "SELECT sql FROM main.sqlite_schema WHERE type = 'view' AND name = ?1");
  view.bind(1, name);
  return view.step() ? view.text(0) : std::string();
}

/// Where a word stands outside brackets, from `at` on.
std::size_t place_of(const std::vector<SqlToken>& tokens, std::string_view word, std::size_t at) {
  for (; at < tokens.size() && !is_word(tokens[at], word); ++at) {
    at = tokens[at].is_sign('(') ? closing_bracket(tokens, at) : at;
  }
  return std::min(at, tokens.size());
}

/// The view `results` with quick lists; empty: it is not as we know it.
std::string quick_results(const std::string& view) {
  const auto tokens = sql_tokens(view);
  const std::size_t select = place_of(tokens, "select", 0);
  const std::size_t from = place_of(tokens, "from", select);
  if (from == tokens.size()) {
    return {};
  }
  const std::vector<SqlToken> selected(tokens.begin() + static_cast<std::ptrdiff_t>(select) + 1,
                                       tokens.begin() + static_cast<std::ptrdiff_t>(from));
  std::string columns;
  std::size_t replaced = 0;
  for (const SqlItem& item : sql_items(selected)) {
    columns += columns.empty() ? "" : ", ";
    const auto* const list =
        std::find_if(kQuickLists.begin(), kQuickLists.end(),
                     [&](const QuickList& known) { return known.name == item.name; });
    if (list == kQuickLists.end()) {
      columns += item.whole;
    } else {
      // Out of coalesce() alone SQLite 3.40 does not pass on that a text is JSON.
      columns += fmt::format("CASE WHEN {} IS NOT NULL THEN coalesce({}, {}) END AS {}",
                             list->needs, list->quick, item.text, item.name);
      ++replaced;
    }
  }
  const auto rest = static_cast<std::size_t>(tokens[from].text.data() - view.data());
  return replaced == kQuickLists.size()
             ? fmt::format("CREATE TEMP VIEW results AS SELECT {} {}", columns, view.substr(rest))
             : "";
}

std::string quick_runs(const std::string& view) {
  const auto tokens = sql_tokens(view);
  const std::size_t select = place_of(tokens, "select", 0);
  return select == tokens.size()
             ? ""
             : fmt::format(
                   "CREATE TEMP VIEW runs AS {}",
                   view.substr(static_cast<std::size_t>(tokens[select].text.data() - view.data())));
}

/// Puts `by` in the place of `text`; false where that does not stand there once.
bool replace_once(std::string& where, std::string_view text, std::string_view by) {
  const std::size_t at = where.find(text);
  if (at == std::string::npos || where.find(text, at + 1) != std::string::npos) {
    return false;
  }
  where.replace(at, text.size(), by);
  return true;
}

/// The quick view `results` with modes that are looked up instead of joined; empty: it is not as we
/// know it.
std::string unjoined_results(std::string view) {
  const bool is_ours =
      replace_once(view, "TEMP VIEW results AS",
                   fmt::format("TEMP VIEW {} AS", kUnjoinedResults)) &&
      replace_once(view, " mode.text AS mode,",
                   " (SELECT text FROM texts WHERE text_id = p.mode) AS mode,") &&
      replace_once(view, " major_mode.text AS major_mode,",
                   " (SELECT text FROM texts WHERE text_id = p.major_mode) AS major_mode,") &&
      replace_once(view, "LEFT JOIN texts AS mode ON mode.text_id = p.mode", "") &&
      replace_once(view, "LEFT JOIN texts AS major_mode ON major_mode.text_id = p.major_mode", "");
  return is_ours ? view : "";
}

}  // namespace

bool has_unjoined_results(sqlite3* database) {
  Statement view(database, "SELECT 1 FROM temp.sqlite_schema WHERE type = 'view' AND name = ?1");
  view.bind(1, kUnjoinedResults);
  return view.step();
}

void add_quick_views(sqlite3* database) {
  try {
    const std::string results = quick_results(view_in_file(database, "results"));
    const std::string runs = quick_runs(view_in_file(database, "runs"));
    if (results.empty() || runs.empty()) {
      return;
    }
    execute(database, results);
    execute(database, runs);
    const Statement check(database, "SELECT * FROM temp.runs LIMIT 0");
    if (const std::string unjoined = unjoined_results(results); !unjoined.empty()) {
      execute(database, unjoined);
    }
  } catch (const NotSqlPart&) {
    return;  // nothing was made yet
  } catch (const StorageError&) {
    for (const char* const view : {"runs", "results", kUnjoinedResults}) {
      execute(database, fmt::format("DROP VIEW IF EXISTS temp.{}", view));
    }
  }
}

}  // namespace oblique::server
