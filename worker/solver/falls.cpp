#include "worker/solver/falls.h"

#include <exception>
#include <utility>

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

FallOutcome solve_fall(const std::shared_ptr<const PreparedChain>& chain) {
  try {
    return {std::make_shared<const FallenChain>(
                chain, Fall(chain->shared_motion(), chain->fall_step_s(),
                            longest_fall_s(chain->chain()), &chain->fall_progress())),
            {}};
  } catch (const std::exception& error) {
    return {nullptr, error.what()};
  }
}

}  // namespace

PreparedChain::PreparedChain(const ModelParameters& model)
    : model_(fall_model(model)),
      chain_(model_),
      motion_(make_motion(model_, chain_)),
      fall_step_s_(StepChoice(chain_, model_).fall_s()) {}

std::vector<FallOutcome> solve_falls(std::span<const std::shared_ptr<const PreparedChain>> chains) {
  std::vector<FallOutcome> outcomes;
  outcomes.reserve(chains.size());
  for (const auto& chain : chains) {
    outcomes.push_back(solve_fall(chain));
  }
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
