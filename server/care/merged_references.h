#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "server/database/sqlite.h"
#include "server/store/rows/text_numbers.h"

// What results refer to, of a database that is merged, in the target.
namespace oblique::server {

/// Models. Two of one definition are one.
class MergedModels {
 public:
  MergedModels(sqlite3* source, sqlite3* target);

  /// The number in the target of the model that has this one in the source; it is brought there
  /// when it is not. Throws StorageError when the source has none.
  std::int64_t in_target(std::int64_t in_source);

 private:
  sqlite3* target_;
  Statement read_;
  Statement find_;
  Statement insert_;
  std::unordered_map<std::int64_t, std::int64_t> known_;  // some of them
};

/// Sessions of workers. Two that began at one instant under one name are one.
class MergedWorkers {
 public:
  /// The source must have `row_checksum`. Throws StorageError when one of its workers is not as it
  /// was stored.
  MergedWorkers(sqlite3* source, sqlite3* target);

  /// As of MergedModels.
  std::int64_t in_target(std::int64_t in_source);

 private:
  std::int64_t insert_session();
  static std::string session_in(const Statement& row);

  sqlite3* target_;
  Statement read_;
  Statement insert_;
  std::unordered_map<std::string, std::int64_t> there_;  // by all that is known of the session
  std::unordered_map<std::int64_t, std::int64_t> known_;
};

/// The table `texts`.
class MergedTexts {
 public:
  MergedTexts(sqlite3* source, TextNumbers& target);

  /// As of MergedModels.
  std::int64_t in_target(std::int64_t in_source);

 private:
  Statement read_;
  TextNumbers& target_;
  std::unordered_map<std::int64_t, std::int64_t> known_;  // some of them
};

}  // namespace oblique::server
