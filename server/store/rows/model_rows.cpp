#include "server/store/rows/model_rows.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <nlohmann/json.hpp>

namespace oblique::server {

std::string insert_model_sql() {
  // The keys are the columns, but for those handled first.
  std::string names = "definition, lengths_m";
  std::string marks = "?, ?";
  for (const auto& key : solver::model_keys()) {
    names += ", " + std::string(key.name);
    marks += ", ?";
  }
  return "INSERT INTO models (" + names + ") VALUES (" + marks +
         ") ON CONFLICT (definition) DO NOTHING";
}

void bind_model(Statement& insert, const solver::ModelParameters& model,
                std::string_view definition) {
  insert.reset();
  insert.bind(1, definition);
  insert.bind(2, nlohmann::json(model.lengths_m).dump());
  int index = 3;
  for (const auto& key : solver::model_keys()) {
    const double value = key.get(model);
    const bool whole = key.name == "links" || key.name == "elements_per_link";
    if (key.name == "integrator") {
      insert.bind(index, solver::integrator_name(model.integrator));
    } else if (whole) {
      insert.bind(index, static_cast<std::int64_t>(value));
    } else if (key.name != "length" ||
               std::count(model.lengths_m.begin(), model.lengths_m.end(), value) ==
                   static_cast<std::ptrdiff_t>(model.lengths_m.size())) {
      insert.bind(index, value);
    }
    ++index;
  }
}

}  // namespace oblique::server
