#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/recipe/point_table.h"
#include "server/store/known/axis_inverse.h"

namespace oblique::server {

/// Least and largest values of H, mu and e; without limits where they follow from others.
struct PointBox {
  std::array<double, 3> least;
  std::array<double, 3> largest;

  void include(const PointBox& other);
  bool is_apart_from(const PointBox& other) const;
};

/// Of one block, and of all. Costs a look at each listed value.
PointBox box_of(const protocol::Block& block);
PointBox box_of(const protocol::Recipe& recipe);

/// One block of a recipe and where its points stand in the study.
struct PlacedBlock {
  const protocol::PointTable* table;
  const protocol::Block* block;
  std::uint64_t first_point;
  std::uint64_t points;
  PointBox box;

  std::uint64_t end() const { return first_point + points; }
};

/// The blocks of a study. Their points refer to the table, which must outlive them.
std::vector<PlacedBlock> blocks_of(const protocol::PointTable& table);

/// Whether only a look at a point tells that it can be solved and that no filter leaves it out.
bool needs_look(const protocol::PointTable& table);

/// Null when the block has no such axis.
const protocol::Axis* axis_of(const protocol::Block& block, std::string_view key);

/// Whether its points are the product of listed values and ranges of keys that stand alone.
bool is_product(const protocol::Block& block);

/// The model that the axes of blocks are put upon.
solver::ModelParameters base_model_of(const protocol::PointTable& table);

/// Which point of a product has given values.
class ProductInverse {
 public:
  explicit ProductInverse(const PlacedBlock& block);

  /// Of that model, which a number stands for: equal ones are looked up once.
  std::optional<std::uint64_t> find(std::uint64_t model_number,
                                    const solver::ModelParameters& model, double H_m, double mu,
                                    double e_star);
  /// The same for the model that was given last.
  bool knows_model(std::uint64_t model_number) const { return model_number_ == model_number; }

 private:
  std::optional<std::uint64_t> find_model(const solver::ModelParameters& model) const;

  PlacedBlock block_;
  solver::ModelParameters base_;
  std::vector<AxisInverse> axes_;  // the slowest first
  std::vector<std::uint64_t> sizes_;
  std::optional<std::uint64_t> model_number_;
  std::optional<std::uint64_t> model_;  // where its points begin, in models
};

}  // namespace oblique::server
