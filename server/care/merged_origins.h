#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>

#include "server/care/merged_studies.h"
#include "server/database/sqlite.h"

namespace oblique::server {

/// From which studies rows of a database that is merged were taken over, in the target: the place
/// of a study that comes along, else a number that no study has, with the name that is known.
class MergedOrigins {
 public:
  /// All must outlive this.
  MergedOrigins(sqlite3* source, sqlite3* target, const StudyPlaces& places);

  /// The target's text for `packed_results.taken_from` of a row of the source. Throws StorageError.
  std::string in_target(const std::string& taken_from);

 private:
  std::int64_t number_of(std::int64_t in_source);
  std::int64_t number_without_study(const std::string& name);

  const StudyPlaces& places_;
  Statement read_;
  Statement find_;
  Statement reserve_;
  Statement insert_;
  std::unordered_map<std::int64_t, std::int64_t> known_;
};

/// Makes `taken_points` of the study anew, of its rows. Throws StorageError.
void count_taken_points(sqlite3* database, std::uint64_t study_id);

}  // namespace oblique::server
