#pragma once

#include <string>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "worker/solver/model/parameters.h"

// H, mu, e and the model of a point. Two machines may compute them with different last bits.
namespace oblique::protocol {

/// Whether `value` equals the finite number `own` to within a relative difference of 1e-12. Only
/// zero is close to zero.
bool is_close(double value, double own);
/// Whether every parameter is close. Whole numbers must be equal.
bool is_close(const solver::ModelParameters& model, const solver::ModelParameters& own);

/// Sets the inputs of the result's point; the model only if the study has several.
void set_inputs(PointResult& result, const PointTable& table);

/// Why the inputs of a result are not those of its point in `table`, or an empty text. A failed
/// point may have none.
std::string fault_of_inputs(const PointResult& result, const PointTable& table);

/// The inputs of a result, or of its point in `table` when it has none.
Point inputs_of(const PointResult& result, const PointTable& table);

}  // namespace oblique::protocol
