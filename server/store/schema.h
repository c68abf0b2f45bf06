#pragma once

#include <string>
#include <vector>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Creates all tables, indices and views in an empty database and gives it a random ID. Throws
/// StorageError.
void create_tables(sqlite3* database);

/// A row of `sqlite_schema`.
struct SchemaElement {
  std::string type, name, table, sql;
  bool operator==(const SchemaElement&) const = default;
};

struct SchemaDifferences {
  /// our tables that the file lacks or defines otherwise; if there are none, other such elements
  std::vector<SchemaElement> lacking;
  std::vector<SchemaElement> foreign;  ///< elements of other programs
};

/// Compares the text of every definition in a file with this schema. Throws StorageError.
SchemaDifferences compare_schema(sqlite3* database);

/// Returns a sentence about an element that a file lacks or defines otherwise.
std::string fault_of(const SchemaElement& lacking);

/// Works like `open_stored`, but also throws StorageError if the file lacks one of our definitions
/// or has it changed, because then answers may be wrong.
DatabaseHandle open_with_schema(const std::string& path);

/// Makes indices, triggers and views again that the file lacks or defines otherwise. Throws
/// StorageError if a table differs, or if a table has the name of a view.
void restore_schema(sqlite3* database, const std::string& path);

/// An SQL expression for the highest study number that was ever used, or 0. It also considers rows
/// of `results` whose study was deleted by hand.
inline constexpr const char* kLastStudyId =
    "max((SELECT coalesce(max(seq), 0) FROM main.sqlite_sequence),"
    " (SELECT coalesce(max(study_id), 0) FROM main.results))";

}  // namespace oblique::server
