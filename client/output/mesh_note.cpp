#include "client/output/mesh_note.h"

#include <algorithm>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

/// Elements a link on the coarsest mesh of the study.
int coarsest(const protocol::Recipe& recipe) {
  int least = 0;
  const auto take = [&least](int elements) {
    least = least == 0 ? elements : std::min(least, elements);
  };
  for (const auto& block : recipe.blocks()) {
    const auto axis =
        std::find_if(block.axes().begin(), block.axes().end(),
                     [](const protocol::Axis& each) { return each.key() == "elements_per_link"; });
    if (axis == block.axes().end()) {
      take(protocol::from_message(recipe.model()).elements_per_link);
    } else if (axis->count() > 0) {
      take(static_cast<int>(axis->from()));
    } else if (axis->values().empty()) {
      continue;  // only points tell
    } else {
      take(static_cast<int>(*std::min_element(axis->values().begin(), axis->values().end())));
    }
  }
  return least;
}

}  // namespace

void tell_mesh(std::ostream& out, const protocol::Recipe& recipe) {
  const solver::MeshAccuracy& coarse = solver::mesh_accuracies()[0];
  const solver::MeshAccuracy& enough = solver::mesh_accuracies()[1];
  const int elements = coarsest(recipe);
  if (elements == 0 || elements >= enough.elements_per_link) {
    return;
  }
  const std::string_view bound = elements == coarse.elements_per_link  ? ""
                                 : elements < coarse.elements_per_link ? "more than "
                                                                       : "up to ";
  out << fmt::format(
      "Note: on {} elements a link forces are off by {}{} %, durations by {}{} %, and {}{:.0f} in "
      "10 points get another sequence of states than on {}; to predict: preset = \"{}\"\n",
      elements, bound, coarse.forces_off, bound, coarse.duration_off, bound,
      (100.0 - coarse.same_mode) / 10.0, solver::preset("converged").elements_per_link,
      solver::preset_names().front());
}

}  // namespace oblique::client
