#include "proto/recipe/point_inputs.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"

namespace oblique::protocol {
namespace {

/// Whether the model of the result is model `number`. A result without a model is of a study that
/// had one model when it was solved, but may have grown since.
bool has_model(const PointResult& result, std::uint64_t number, const PointTable& table) {
  if (!result.has_model()) {
    return number == 0;
  }
  try {
    return is_close(unjudged_from_message(result.model()), table.model(number));
  } catch (const solver::InputError&) {  // a whole number outside the domain
    return false;
  }
}

}  // namespace

bool is_close(double value, double own) {
  constexpr double kTolerance = 1e-12;  // relative; some thousand times the rounding of a double
  return std::abs(value - own) <= kTolerance * std::abs(own);
}

bool is_close(const solver::ModelParameters& model, const solver::ModelParameters& own) {
  const auto keys = solver::model_keys();
  return std::equal(model.lengths_m.begin(), model.lengths_m.end(), own.lengths_m.begin(),
                    own.lengths_m.end(), [](double a, double b) { return is_close(a, b); }) &&
         std::all_of(keys.begin(), keys.end(), [&](const solver::ParameterKey& key) {
           return is_close(key.get(model), key.get(own));
         });
}

void set_inputs(PointResult& result, const PointTable& table) {
  const Point point = table.point(result.point());
  result.set_h_m(point.H_m);
  result.set_mu(point.mu);
  result.set_e_star(point.e_star);
  if (table.models() > 1) {
    *result.mutable_model() = to_message(table.model(point.model));
  }
}

std::string fault_of_inputs(const PointResult& result, const PointTable& table) {
  if (!result.error().empty() && !result.has_h_m()) {
    return {};
  }
  const Point own = table.point(result.point());
  for (const auto& [key, is_sent, value, expected] :
       {std::tuple{"H", result.has_h_m(), result.h_m(), own.H_m},
        {"mu", result.has_mu(), result.mu(), own.mu},
        {"e", result.has_e_star(), result.e_star(), own.e_star}}) {
    if (!is_sent || !is_close(value, expected)) {
      return fmt::format("the worker solved it with {} = {:.17g}, and the study has {:.17g}", key,
                         value, expected);
    }
  }
  if (!has_model(result, own.model, table)) {
    return "the worker solved it with another model than the study has";
  }
  return {};
}

Point inputs_of(const PointResult& result, const PointTable& table) {
  return result.has_h_m() ? Point{table.segment_at(result.point()).model, result.h_m(), result.mu(),
                                  result.e_star()}
                          : table.point(result.point());
}

}  // namespace oblique::protocol
