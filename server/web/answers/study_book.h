#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>

#include <sqlite3.h>

#include "proto/recipe/point_table.h"

namespace oblique::server {

/// A study as the page looks at it.
struct LookedAtStudy {
  std::uint64_t id;
  std::string name;
  std::string state;     ///< as the database has it
  std::uint64_t points;  ///< with those that a filter leaves out
  std::shared_ptr<const protocol::PointTable> table;
};

/// Studies of the database, and the tables of those that were looked at last. Used by several
/// threads.
class StudyBook {
 public:
  /// Throws NothingThere for a study that is not in the database, StorageError.
  LookedAtStudy study(sqlite3* database, std::uint64_t id);

 private:
  struct Kept {
    std::uint64_t id;
    std::uint64_t points;  // a study that grows has more
    std::shared_ptr<const protocol::PointTable> table;
  };

  std::mutex mutex_;
  std::list<Kept> kept_;  // guarded by mutex_; the one looked at last comes first
};

}  // namespace oblique::server
