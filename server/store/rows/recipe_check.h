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

  /// What in the present row is not as the recipe has it: the point, or H, mu, e or the model by
  /// more than another machine may compute it (proto/recipe/point_inputs.h). Empty: nothing.
  std::string fault_of(const Statement& row);

 private:
  /// Whether that row of `models` is the model of the latest row.
  bool agrees(std::int64_t model_id);

  /// The model of the latest row.
  struct Model {
    std::uint64_t number;
    solver::ModelParameters parameters;
    std::int64_t good_id;  ///< row of `models` that has it; -1: none was seen
  };
  const protocol::PointTable& table_;
  std::optional<Model> model_;
  Statement definition_;
};

}  // namespace oblique::server
