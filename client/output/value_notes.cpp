#include "client/output/value_notes.h"

#include <cmath>
#include <map>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/usual_ranges.h"

namespace oblique::client {

void tell_values(std::ostream& out, const protocol::Recipe& recipe) {
  std::map<std::string_view, std::string> unusual;  // the first of each key
  const auto look_at = [&unusual](const solver::ParameterKey& key, double value) {
    if (std::string note = solver::note_on_value(key, value); !note.empty()) {
      unusual.try_emplace(key.name, std::move(note));
    }
  };
  const auto model = protocol::from_message(recipe.model());
  for (const auto& key : solver::model_keys()) {
    look_at(key, key.get(model));
  }
  for (const double length_m : model.lengths_m) {
    look_at(*solver::find_model_key("length"), length_m);
  }
  std::string drawn;
  for (const auto& block : recipe.blocks()) {
    for (const auto& axis : block.axes()) {
      if (!axis.expression().empty()) {
        continue;
      }
      const auto& key = protocol::axis_key(axis.key());
      look_at(key, axis.distribution().mean());
      look_at(key, protocol::smallest_value(axis));
      look_at(key, protocol::largest_value(axis));
      const bool is_whole = !key.is_allowed(std::nextafter(axis.from(), axis.to()));
      if (block.has_sample() && axis.count() > 1 && !is_whole) {
        drawn += fmt::format("Note: {}: {} values; {}:{} draws between them.\n", axis.key(),
                             axis.count(), solver::readable_number(axis.from()),
                             solver::readable_number(axis.to()));
      }
    }
  }
  for (const auto& [key, note] : unusual) {
    out << "Note: " << note << '\n';
  }
  out << drawn;
}

}  // namespace oblique::client
