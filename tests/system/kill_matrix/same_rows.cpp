#include "tests/system/kill_matrix/same_rows.h"

#include <algorithm>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "tests/support/database.h"
#include "tests/support/programs.h"

namespace oblique::test {
namespace {

struct Table {
  std::string name;
  std::set<std::string> by_chance;  ///< columns
  std::string joined;
  std::string order;
};

std::vector<Table> tables() {
  return {
      {"studies",
       {"created_at", "changed_at", "checksum", "submitted_by", "counted"},
       "",
       "study_id"},
      {"models", {"model_id"}, "", "definition"},
      // The model's number is one by order of arrival, so its definition stands in for it.
      {"results",
       {"model_id", "wall_s", "worker_id", "attempt", "solved_at", "checksum"},
       " JOIN models USING (model_id)",
       "study_id, point"},
  };
}

/// Every row as one text. The columns are asked for, so that new ones are compared too.
std::vector<std::string> rows_of(const Database& database, const Table& table) {
  // quote() writes numbers so that they are read again as the same ones.
  std::string row = table.joined.empty() ? "''" : "quote(models.definition)";
  for (const std::string& column :
       database.texts("SELECT name FROM pragma_table_info('" + table.name + "')")) {
    if (!table.by_chance.contains(column)) {
      row += " || ' " + column + "=' || quote(" + table.name + "." + column + ")";
    }
  }
  return database.texts("SELECT " + row + " FROM " + table.name + table.joined + " ORDER BY " +
                        table.order);
}

}  // namespace

std::string first_difference(const std::string& database, const std::string& other) {
  for (const Table& table : tables()) {
    const auto rows = rows_of(Database(database), table);
    const auto others = rows_of(Database(other), table);
    const std::size_t both = std::min(rows.size(), others.size());
    for (std::size_t i = 0; i < both; ++i) {
      if (rows[i] != others[i]) {
        return table.name + ", row " + std::to_string(i) + ":\n" + rows[i] + "\n" + others[i];
      }
    }
    if (rows.size() != others.size()) {
      return table.name + ": " + std::to_string(rows.size()) + " rows and " +
             std::to_string(others.size());
    }
  }
  return {};
}

}  // namespace oblique::test
