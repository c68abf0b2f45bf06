#include "client/study/study.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

/// Returns the smallest number of elements per link in any block. Ignores expressions.
int coarsest_mesh(const protocol::Recipe& recipe) {
  constexpr int kUnknown = std::numeric_limits<int>::max();
  int coarsest = kUnknown;
  for (const auto& block : recipe.blocks()) {
    int elements = protocol::from_message(recipe.model()).elements_per_link;
    for (const auto& axis : block.axes()) {
      if (axis.key() == "elements_per_link") {
        elements =
            axis.expression().empty() ? static_cast<int>(protocol::smallest_value(axis)) : kUnknown;
      }
    }
    coarsest = std::min(coarsest, elements);
  }
  return coarsest;
}

}  // namespace

solver::InputError Places::located(const solver::InputError& error) const {
  const auto& fields = error.fields();
  if (!fields.block && blocks.size() != 1) {
    return error.at(whole);
  }
  const auto& block = blocks.at(fields.block.value_or(0));
  const auto found = block.contains(fields.key) ? block.find(fields.key) : block.find("");
  return error.at(found != block.end() ? found->second : whole);
}

void check_points(const protocol::PointTable& table, const Places& places) {
  try {
    table.validate_points();
  } catch (const solver::InputError& error) {
    throw places.located(error);
  }
}

void check_points(const Study& study) {
  check_points(protocol::PointTable(study.recipe), study.places);
}

void note_coarse_mesh(std::ostream& out, const protocol::Recipe& recipe) {
  const solver::MeshAccuracy& coarse = solver::mesh_accuracies()[0];
  const solver::MeshAccuracy& enough = solver::mesh_accuracies()[1];
  const int elements = coarsest_mesh(recipe);
  if (elements >= enough.elements_per_link) {
    return;
  }
  const std::string_view bound = elements == coarse.elements_per_link  ? ""
                                 : elements < coarse.elements_per_link ? "more than "
                                                                       : "up to ";
  out << fmt::format(
      "Note: {} elements a link give errors of {}{} % in forces, {}{} % in durations, and another "
      "sequence of states for {}{:.0f} in 10 points, compared with {}; use preset = \"{}\" for "
      "predictions\n",
      elements, bound, coarse.forces_off, bound, coarse.duration_off, bound,
      (100.0 - coarse.same_mode) / 10.0, solver::preset("converged").elements_per_link,
      solver::preset_names().front());
}

void note_unusual_values(std::ostream& out, const protocol::Recipe& recipe) {
  std::map<std::string_view, std::string> unusual;  // the first note for each key
  const auto check = [&unusual](const solver::ParameterKey& key, double value) {
    if (std::string note = solver::note_on_value(key, value); !note.empty()) {
      unusual.try_emplace(key.name, std::move(note));
    }
  };
  const auto model = protocol::from_message(recipe.model());
  for (const auto& key : solver::model_keys()) {
    check(key, key.get(model));
  }
  for (const double length_m : model.lengths_m) {
    check(*solver::find_model_key("length"), length_m);
  }
  std::string lists;
  for (const auto& block : recipe.blocks()) {
    for (const auto& axis : block.axes()) {
      if (!axis.expression().empty()) {
        continue;
      }
      const auto& key = protocol::axis_key(axis.key());
      check(key, axis.distribution().mean());
      check(key, protocol::smallest_value(axis));
      check(key, protocol::largest_value(axis));
      const bool is_whole = !key.is_allowed(std::nextafter(axis.from(), axis.to()));
      if (block.has_sample() && axis.count() > 1 && !is_whole) {
        lists += fmt::format("Note: {} takes {} values; {}:{} draws any value between them.\n",
                             axis.key(), axis.count(), solver::readable_number(axis.from()),
                             solver::readable_number(axis.to()));
      }
    }
  }
  for (const auto& [key, note] : unusual) {
    out << "Note: " << note << '\n';
  }
  out << lists;
}

}  // namespace oblique::client
