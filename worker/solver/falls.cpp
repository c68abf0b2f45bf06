#include "worker/solver/falls.h"

#include <exception>
#include <utility>

#include "worker/solver/fall/collocation_fall.h"
#include "worker/solver/motion/generalized_alpha.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {
namespace {

std::shared_ptr<const Motion> make_motion(const ModelParameters& model, const Chain& chain) {
  if (model.integrator == Integrator::kGeneralizedAlpha) {
    return std::make_shared<GeneralizedAlphaMotion>(model);
  }
  return std::make_shared<ExplicitMotion>(chain);
}

using SharedChain = std::shared_ptr<const PreparedChain>;

/// By steps of one length.
FallOutcome solve_by_steps(const SharedChain& chain) {
  try {
    return {std::make_shared<const FallenChain>(
                chain, Fall(chain->shared_motion(), chain->fall_step_s(),
                            longest_fall_s(chain->chain()), &chain->fall_progress())),
            {}};
  } catch (const std::exception& error) {
    return {nullptr, error.what()};
  }
}

/// Whether no step was asked for, nor an accuracy for which explicit steps are quicker.
bool falls_by_collocation(const ModelParameters& model) {
  return model.integrator == Integrator::kExplicit && model.dt_fall_s == 0.0 &&
         model.tolerance >= kTightestCollocation;
}

/// Solves the falls at `places` side by side.
void solve_in_lanes(std::span<const SharedChain> chains, const std::vector<std::size_t>& places,
                    std::vector<FallOutcome>& outcomes) {
  std::vector<FallRequest> requests;
  for (const std::size_t place : places) {
    const PreparedChain& chain = *chains[place];
    requests.push_back(
        {&chain.chain(), &chain.model(), chain.model().tolerance, &chain.fall_progress()});
  }
  std::vector<FallSolution> solutions = solve_by_collocation(requests);
  for (std::size_t i = 0; i < places.size(); ++i) {
    FallOutcome& outcome = outcomes[places[i]];
    outcome.error = std::move(solutions[i].error);
    if (solutions[i].path) {
      outcome.fallen = std::make_shared<const FallenChain>(chains[places[i]],
                                                           Fall(std::move(solutions[i].path)));
    }
  }
}

}  // namespace

PreparedChain::PreparedChain(const ModelParameters& model)
    : model_(fall_model(model)),
      chain_(model_),
      motion_(make_motion(model_, chain_)),
      fall_step_s_(StepChoice(chain_, model_).fall_s()) {}

bool fall_side_by_side(const ModelParameters& a, const ModelParameters& b) {
  return falls_by_collocation(a) && falls_by_collocation(b) &&
         a.lengths_m.size() == b.lengths_m.size() && a.elements_per_link == b.elements_per_link;
}

std::vector<FallOutcome> solve_falls(std::span<const std::shared_ptr<const PreparedChain>> chains) {
  std::vector<FallOutcome> outcomes(chains.size());
  std::vector<std::size_t> in_lanes;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    if (falls_by_collocation(chains[i]->model())) {
      in_lanes.push_back(i);
    } else {
      outcomes[i] = solve_by_steps(chains[i]);
    }
  }
  solve_in_lanes(chains, in_lanes, outcomes);
  return outcomes;
}

std::vector<FallOutcome> solve_falls(std::span<const ModelParameters> models) {
  std::vector<FallOutcome> outcomes(models.size());
  std::vector<std::shared_ptr<const PreparedChain>> chains;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < models.size(); ++i) {
    try {
      chains.push_back(std::make_shared<const PreparedChain>(models[i]));
      places.push_back(i);
    } catch (const std::exception& error) {
      outcomes[i].error = error.what();
    }
  }
  std::vector<FallOutcome> solved = solve_falls(chains);
  for (std::size_t i = 0; i < solved.size(); ++i) {
    outcomes[places[i]] = std::move(solved[i]);
  }
  return outcomes;
}

}  // namespace oblique::solver
