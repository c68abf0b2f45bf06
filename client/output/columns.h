#pragma once

#include <string>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::client {

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

/// How tables for people show a column.
struct ShownColumn {
  std::string heading;    ///< its name, with the unit in brackets where that is not the SI one
  double per_unit = 1.0;  ///< so much is shown for 1 in SI units
};
ShownColumn shown_column(const std::string& name);

/// For tables that people read: columns whose values are small in SI units become those of
/// `solve`'s report, microseconds and the like, named in brackets in the heading.
protocol::QueryReply in_shown_units(protocol::QueryReply rows);

}  // namespace oblique::client
