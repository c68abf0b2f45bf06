#include "worker/solver/falls.h"

#include <cstddef>
#include <exception>
#include <map>
#include <new>
#include <tuple>
#include <utility>

#include "worker/solver/fast/lane_falls.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/reference/generalized_alpha.h"
#include "worker/solver/step_choice.h"

namespace oblique::solver {
namespace {

std::shared_ptr<const Motion> make_motion(const ModelParameters& model, const Chain& chain) {
  if (model.integrator == Integrator::kGeneralizedAlpha) {
    return std::make_shared<GeneralizedAlphaMotion>(model);
  }
  return std::make_shared<ExplicitMotion>(chain);
}

/// Explicit steps in sqrt(2 length / g), up to which they are quicker than collocation
/// (fast/README.md).
constexpr double kFewSteps = 150'000.0;

enum class WayToFall { kStepsAlone, kSteps, kCollocation };

WayToFall way_to_fall(const FallenChain& chain) {
  const ModelParameters& model = chain.model();
  if (model.integrator != Integrator::kExplicit) {
    return WayToFall::kStepsAlone;
  }
  const double steps = longest_fall_s(chain.chain()) / kLongestFall / chain.fall_step_s();
  return model.dt_fall_s != 0.0 || model.tolerance < kTightestCollocation || steps <= kFewSteps
             ? WayToFall::kSteps
             : WayToFall::kCollocation;
}

FallSolution solve_alone(const FallRequest& request) {
  try {
    return {solve_stepped_fall(request.motion, request.dt_s, longest_fall_s(*request.chain),
                               request.progress),
            {}};
  } catch (const std::bad_alloc&) {  // says nothing of this fall
    throw;
  } catch (const std::exception& error) {
    return {nullptr, error.what()};
  }
}

/// Solves falls, all in one way and of one shape.
std::vector<FallSolution> solve(WayToFall way, std::span<const FallRequest> requests) {
  if (way == WayToFall::kCollocation) {
    return solve_by_collocation(requests);
  }
  if (way == WayToFall::kSteps) {
    return solve_by_steps(requests);
  }
  std::vector<FallSolution> solutions;
  for (const FallRequest& request : requests) {
    solutions.push_back(solve_alone(request));
  }
  return solutions;
}

}  // namespace

FallenChain::FallenChain(const ModelParameters& model)
    : model_(fall_model(model)),
      chain_(model_),
      motion_(make_motion(model_, chain_)),
      fall_step_s_(StepChoice(chain_, model_).fall_s()) {}

bool fall_side_by_side(const ModelParameters& a, const ModelParameters& b) {
  return a.integrator == Integrator::kExplicit && b.integrator == Integrator::kExplicit &&
         a.lengths_m.size() == b.lengths_m.size() && a.elements_per_link == b.elements_per_link;
}

std::vector<FallOutcome> solve_falls(std::span<const std::shared_ptr<FallenChain>> chains) {
  using Kind = std::tuple<WayToFall, std::size_t, int>;  // with links and elements a link
  std::map<Kind, std::vector<std::size_t>> places;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    const ModelParameters& model = chains[i]->model();
    places[{way_to_fall(*chains[i]), model.lengths_m.size(), model.elements_per_link}].push_back(i);
  }
  std::vector<FallOutcome> outcomes(chains.size());
  for (const auto& [kind, alike] : places) {
    std::vector<FallRequest> requests;
    for (const std::size_t place : alike) {
      const FallenChain& chain = *chains[place];
      requests.push_back({&chain.chain(), chain.motion(), chain.fall_step_s(),
                          chain.model().tolerance, &chain.fall_progress()});
    }
    std::vector<FallSolution> solutions = solve(std::get<WayToFall>(kind), requests);
    for (std::size_t i = 0; i < alike.size(); ++i) {
      const std::shared_ptr<FallenChain>& chain = chains[alike[i]];
      FallOutcome& outcome = outcomes[alike[i]];
      if (solutions[i].fall) {
        chain->set_fall(std::move(solutions[i].fall));
        outcome.fallen = chain;
      } else {
        outcome.error = with_likely_cause(std::move(solutions[i].error), chain->model());
      }
    }
  }
  return outcomes;
}

std::vector<FallOutcome> solve_falls(std::span<const ModelParameters> models) {
  std::vector<FallOutcome> outcomes(models.size());
  std::vector<std::shared_ptr<FallenChain>> chains;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < models.size(); ++i) {
    try {
      chains.push_back(std::make_shared<FallenChain>(models[i]));
      places.push_back(i);
    } catch (const std::bad_alloc&) {
      throw;
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
