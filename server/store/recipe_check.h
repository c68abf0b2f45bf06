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
  /// The columns that `fault_of` reads, as a list for SQL. A row must begin with them.
  static constexpr const char* kColumns = "point, model_id, H, mu, e";

  /// Both must outlive this.
  RecipeCheck(sqlite3* database, const protocol::PointTable& table)
      : table_(table), definition_(database, "SELECT definition FROM models WHERE model_id = ?") {}

  /// The first difference between the current row and the recipe, as a part of a sentence; empty if
  /// they agree. Compares the point, H, mu, e and the model, with the tolerance for values that
  /// another machine computed (proto/recipe/point_inputs.h).
  std::string fault_of(const Statement& row);

 private:
  /// Whether the row `model_id` of `models` is the model in `model_`.
  bool agrees(std::int64_t model_id);

  /// The model of the latest row.
  struct Model {
    std::uint64_t number;
    solver::ModelParameters parameters;
    std::int64_t good_id;  ///< row of `models` that agrees with it; -1: none yet
  };
  const protocol::PointTable& table_;
  std::optional<Model> model_;
  Statement definition_;
};

}  // namespace oblique::server
