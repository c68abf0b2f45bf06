#pragma once

#include <string>
#include <vector>

namespace oblique::server {

/// What is known of one column of queries or one member of `solve --json`.
struct Column {
  std::string name;
  std::string unit;        ///< SI; empty for pure numbers and texts
  std::string kind;        ///< input, output, or row: about the row in the database
  std::string solve_json;  ///< where `solve --json` has it, as energy.friction_J; empty: nowhere
  std::string meaning;     ///< one line; for inputs with what is allowed, for outputs with the sign
};

/// All of them, in the order of listings: inputs, outputs, what else a row tells.
std::vector<Column> all_columns();

/// What `query` selects from, in parentheses: the view `runs`, with the lists that `solve --json`
/// has and the view packs otherwise.
std::string rows_of_queries();

}  // namespace oblique::server
