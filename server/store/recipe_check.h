#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "proto/recipe/point_table.h"
#include "server/database/sqlite.h"

namespace oblique::server {

/// Compares rows of one study with its recipe. Fast for rows in the order of their points.
class RecipeCheck {
 public:
  /// The columns that `fault_of` reads, as a list for SQL. They come first.
  static constexpr const char* kColumns = "point, model_id, H, mu, e";

  /// Both must outlive this.
  RecipeCheck(sqlite3* database, const protocol::PointTable& table)
      : table_(table), definition_(database, "SELECT definition FROM models WHERE model_id = ?") {}

  /// What in the present row is not as the recipe has it: the point, H, mu, e or the model. Empty:
  /// nothing.
  std::string fault_of(const Statement& row);

 private:
  /// The model of the latest row.
  struct Model {
    std::uint64_t number;
    std::string definition;
    std::int64_t good_id;  ///< row of `models` that has it; -1: none was seen
  };
  const protocol::PointTable& table_;
  std::optional<Model> model_;
  Statement definition_;
};

}  // namespace oblique::server
