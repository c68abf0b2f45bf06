#include "client/output/mesh_note.h"

#include <algorithm>

#include "proto/recipe/model_message.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

/// Elements a link from which on all but exit velocities and reactions are within 0.5 % of their
/// limits (worker/solver/README.md, Which mesh).
constexpr int kForcesConverge = 16;

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
  const int published = solver::preset("paper").elements_per_link;
  const int converged = solver::preset("converged").elements_per_link;
  const int elements = coarsest(recipe);
  if (elements == 0 || elements >= converged) {
    return;
  }
  if (elements >= kForcesConverge) {
    out << "Note: on " << elements
        << " elements a link forces, times and impulses are converged, exit velocities and "
           "reactions less so; --preset converged has "
        << converged << " (README.md, Limits).\n";
    return;
  }
  out << "Note: the mesh, " << elements << " elements a link"
      << (elements == published ? " as published" : "")
      << ", is not converged; to predict, take --preset converged, in a study file preset = "
         "\"converged\" (README.md, Limits).\n";
}

}  // namespace oblique::client
