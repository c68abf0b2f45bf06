#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "proto/recipe/point_table.h"
#include "server/study/recipe_growth.h"

namespace oblique::server {

/// The points of a study as the server keeps them: always the bytes of the recipe, and the table
/// made of them only while somebody computes with it. A study that rests or is done costs its bytes
/// and nothing else. Copies share the table. Not thread-safe but for `size` and `recipe_bytes`;
/// other threads are given what `get` returned.
class StudyTable {
 public:
  StudyTable() = default;
  /// Of a recipe that was judged just now.
  StudyTable(std::shared_ptr<const protocol::PointTable> table);  // NOLINT: as good as the other
  /// Of a recipe that was judged when it was stored, and of so many points.
  StudyTable(std::string recipe_bytes, std::uint64_t points);

  /// How many points it has, also those that filters leave out.
  std::uint64_t size() const { return shared_->points; }
  /// oblique.protocol.Recipe, serialised.
  const std::string& recipe_bytes() const { return shared_->recipe_bytes; }

  /// Whether both have the same recipe; false when one cannot be read. Reads both if their bytes
  /// differ and their sizes do not.
  bool is_of_the_recipe_of(const StudyTable& other) const;

  /// What another recipe is to this one. Costs in proportion to both. Throws std::runtime_error
  /// when one of them cannot be read.
  Growth growth_to(const StudyTable& other) const;

  /// The table, made when there is none. Throws solver::InputError for a recipe that this version
  /// does not take, and std::runtime_error for bytes that are no recipe of so many points.
  const std::shared_ptr<const protocol::PointTable>& get() const;
  const protocol::PointTable* operator->() const { return get().get(); }

  /// Forgets the table. It is made again when it is asked for.
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
