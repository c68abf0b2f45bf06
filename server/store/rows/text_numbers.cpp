#include "server/store/rows/text_numbers.h"

#include <string_view>

namespace oblique::server {

TextNumbers::TextNumbers(sqlite3* database)
    : find_(database, "SELECT text_id FROM texts WHERE text = ?"),
      add_(database,
           "INSERT INTO texts (text_id, text, checksum) SELECT n, ?1, row_checksum(n, ?1) FROM"
           " (SELECT coalesce(max(text_id), 0) + 1 AS n FROM texts)") {}

std::int64_t TextNumbers::number_of(const std::string& text) {
  constexpr std::size_t kMostKnown = 4096;
  if (const auto known = known_.find(text); known != known_.end()) {
    return known->second;
  }
  const auto find = [&] {
    find_.bind(1, std::string_view(text));
    const std::int64_t number = find_.step() ? find_.integer(0) : 0;
    find_.reset();
    return number;
  };
  std::int64_t number = find();
  if (number == 0) {
    add_.bind(1, std::string_view(text));
    add_.run();
    number = find();
  }
  if (known_.size() >= kMostKnown) {
    known_.clear();
  }
  known_.emplace(text, number);
  return number;
}

}  // namespace oblique::server
