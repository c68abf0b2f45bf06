#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/database/sqlite.h"
#include "server/store/known/recipe_blocks.h"
#include "server/store/known/recipe_match.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// A study from which points may be taken over.
class KnownSource {
 public:
  KnownSource(std::uint64_t study_id, StudyTable table)
      : study_id_(study_id), table_(std::move(table)) {}

  std::uint64_t study_id() const { return study_id_; }
  /// Whether it may have points of such a recipe. The first time it reads the source's recipe.
  bool may_have(const protocol::Recipe& wanted, const PointBox& box, Work& work);
  /// Null when this version does not take its recipe.
  std::unique_ptr<const protocol::PointTable> points() const;

 private:
  std::uint64_t study_id_;
  StudyTable table_;  // of which only the bytes are read: others use it too
  std::unique_ptr<PointBox> box_;
  bool wants_errors_ = false;
  bool is_readable_ = true;
};

/// Which points of `wanted` among `open` are known from that source: they have a row that says
/// solved there, of that solver version as far as the study says so. Reads the database; throws
/// StorageError.
void find_known(sqlite3* database, const protocol::PointTable& wanted, const IntervalSet& open,
                const KnownSource& source, const std::string& solver_version, Work& work,
                const std::function<void(const SharedRun&)>& take);

/// Those of so many points of the study that have no row. Throws StorageError.
IntervalSet open_points(sqlite3* database, std::uint64_t study_id, std::uint64_t points);

}  // namespace oblique::server
