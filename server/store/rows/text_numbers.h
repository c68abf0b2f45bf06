#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "server/database/sqlite.h"

namespace oblique::server {

/// The table `texts`: words that many rows have, each by a number. Modes and the like.
class TextNumbers {
 public:
  /// The connection must have `row_checksum`.
  explicit TextNumbers(sqlite3* database);

  /// The number of the text, which gets one when it has none. Throws StorageError.
  std::int64_t number_of(const std::string& text);
  /// To be called when a transaction was rolled back: numbers given in it mean nothing.
  void forget() { known_.clear(); }

 private:
  Statement find_;
  Statement add_;
  std::unordered_map<std::string, std::int64_t> known_;  // some of them
};

}  // namespace oblique::server
