#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "proto/recipe/point_table.h"

namespace oblique::server {

/// How a given recipe differs from the stored recipe of a study.
struct Growth {
  enum class Kind {
    kSame,     ///< both have the same model and blocks
    kLonger,   ///< the given recipe begins with the stored one, so the study may grow
    kShorter,  ///< the stored recipe begins with the given one
    kOther,
  };
  Kind kind;
  /// The differences, one per line. Set for kShorter and kOther.
  std::string difference;
};

/// Compares two checked recipes block by block, as they are written. A study can grow by blocks at
/// its end, or by a larger count in the sample of its last block, except in a Latin hypercube.
Growth growth_of(const protocol::Recipe& stored, const protocol::Recipe& given);

/// The recipe of a study in the server: its bytes and the table of its points. The table is made
/// when it is needed and can be released; a paused or done study then needs memory for the bytes
/// only. Copies share the table. Not thread-safe except `size` and `recipe_bytes`; other threads
/// may use the table that `get` returned.
class StudyTable {
 public:
  StudyTable() = default;
  /// Uses the table of a recipe that passed `validate_points`.
  StudyTable(std::shared_ptr<const protocol::PointTable> table);  // NOLINT: implicit on purpose
  /// Uses the bytes and the number of points of a stored recipe, which was validated before.
  StudyTable(std::string recipe_bytes, std::uint64_t points);

  /// Returns the number of points, including left-out points.
  std::uint64_t size() const { return shared_->points; }
  /// Encoded oblique.protocol.Recipe.
  const std::string& recipe_bytes() const { return shared_->recipe_bytes; }

  /// Returns how the recipe of `other` differs from this one. Takes time proportional to their
  /// sizes. Throws std::runtime_error if one of them cannot be read.
  Growth growth_to(const StudyTable& other) const;

  /// Returns the table, and makes it if necessary. Throws solver::InputError for a recipe that this
  /// version refuses, and std::runtime_error for bytes that are not a recipe of `size` points.
  const std::shared_ptr<const protocol::PointTable>& get() const;
  const protocol::PointTable* operator->() const { return get().get(); }

  /// Frees the table; `get` makes it again.
  void release() const { shared_->table.reset(); }
  bool is_made() const { return shared_->table != nullptr; }

 private:
  struct Shared {
    std::string recipe_bytes;
    std::uint64_t points;
    std::shared_ptr<const protocol::PointTable> table;
  };
  std::shared_ptr<Shared> shared_;
};

}  // namespace oblique::server
