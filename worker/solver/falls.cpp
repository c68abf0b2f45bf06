#include "worker/solver/falls.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <iterator>
#include <map>
#include <string>
#include <tuple>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/fast/lane_falls.h"
#include "worker/solver/model/errors.h"
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

/// Explicit steps are faster than collocation if fewer than this fill the time sqrt(2 length/g).
constexpr double kFewSteps = 150'000.0;

bool falls_by_collocation(const FallenChain& chain) {
  const ModelParameters& model = chain.model();
  const double steps = longest_fall_s(chain.chain()) / kLongestFall / chain.fall_step_s();
  return model.integrator == Integrator::kExplicit && model.dt_fall_s == 0.0 &&
         model.tolerance >= kTightestCollocation && steps > kFewSteps;
}

FallSolution solve_alone(const FallRequest& request) {
  try {
    return {solve_stepped_fall(request.motion, request.dt_s, longest_fall_s(*request.chain),
                               request.progress),
            {}};
  } catch (const std::exception& error) {
    return {nullptr, error.what()};
  }
}

/// Memory that a solved fall counts for in the cache.
std::size_t bytes_of(const FallOutcome& outcome) {
  constexpr std::size_t kError = std::size_t{1} << 20;
  return outcome.fallen ? outcome.fallen->fall().bytes() : kError;
}

/// Returns why a parameter of `falling` is not allowed, or an empty text. To be called before
/// find(), because a model with a NaN equals no entry of the cache.
std::string fault_of(const ModelParameters& falling) {
  try {
    validate(falling);
    return {};
  } catch (const InputError& error) {
    return error.what();
  }
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
  // Integrator, whether collocation solves the fall, and numbers of links and elements per link.
  using Kind = std::tuple<Integrator, bool, std::size_t, int>;
  std::map<Kind, std::vector<std::size_t>> places;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    const ModelParameters& model = chains[i]->model();
    places[{model.integrator, falls_by_collocation(*chains[i]), model.lengths_m.size(),
            model.elements_per_link}]
        .push_back(i);
  }
  std::vector<FallOutcome> outcomes(chains.size());
  for (const auto& [kind, alike] : places) {
    std::vector<FallRequest> requests;
    for (const std::size_t place : alike) {
      const FallenChain& chain = *chains[place];
      requests.push_back({&chain.chain(), chain.motion(), chain.fall_step_s(),
                          chain.model().tolerance, &chain.fall_progress()});
    }
    std::vector<FallSolution> solutions;
    if (std::get<Integrator>(kind) == Integrator::kExplicit) {
      solutions = std::get<bool>(kind) ? solve_by_collocation(requests) : solve_by_steps(requests);
    } else {
      std::transform(requests.begin(), requests.end(), std::back_inserter(solutions), solve_alone);
    }
    for (std::size_t i = 0; i < alike.size(); ++i) {
      const std::shared_ptr<FallenChain>& chain = chains[alike[i]];
      if (solutions[i].fall) {
        chain->set_fall(std::move(solutions[i].fall));
        outcomes[alike[i]].fallen = chain;
      } else {
        outcomes[alike[i]].error = with_likely_cause(std::move(solutions[i].error), chain->model());
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

// ---- FallCache ----------------------------------------------------------------------------------

FallCache::FallCache(std::size_t most_bytes, Solve solve)
    : most_bytes_(most_bytes), solve_(std::move(solve)) {
  if (!solve_) {
    solve_ = [](std::span<const ModelParameters> models) { return solve_falls(models); };
  }
}

FallOutcome FallCache::fall(const ModelParameters& model, std::span<const ModelParameters> ahead) {
  const ModelParameters falling = fall_model(model);
  if (std::string fault = fault_of(falling); !fault.empty()) {
    return {nullptr, std::move(fault)};
  }
  std::unique_lock lock(mutex_);
  while (true) {
    const auto found = find(falling);
    if (found != entries_.end() && found->outcome) {
      return use(found);
    }
    const auto claimed = claim(falling, ahead);
    if (claimed.empty()) {
      solved_.wait(lock);
    } else {
      solve(claimed, lock);
    }
  }
}

std::vector<FallOutcome> FallCache::falls(std::span<const ModelParameters> models) {
  std::vector<FallOutcome> outcomes;
  for (std::size_t i = 0; i < models.size(); ++i) {
    outcomes.push_back(fall(models[i], models.subspan(i + 1)));
  }
  return outcomes;
}

std::optional<FallOutcome> FallCache::kept_fall(const ModelParameters& model) {
  const ModelParameters falling = fall_model(model);
  const std::lock_guard lock(mutex_);
  const auto found = find(falling);
  return found != entries_.end() && found->outcome ? std::optional(use(found)) : std::nullopt;
}

FallCache::Entries::iterator FallCache::find(const ModelParameters& falling) {
  return std::find_if(entries_.begin(), entries_.end(),
                      [&](const Entry& entry) { return entry.model == falling; });
}

FallOutcome FallCache::use(Entries::iterator entry) {
  entries_.splice(entries_.begin(), entries_, entry);
  entry->is_used = true;
  return *entry->outcome;
}

/// Makes entries for the missing falls that this thread will solve.
std::vector<FallCache::Entries::iterator> FallCache::claim(const ModelParameters& falling,
                                                           std::span<const ModelParameters> ahead) {
  const bool in_lanes = fall_side_by_side(falling, falling);
  const std::size_t most = in_lanes ? runnable_lane_kernels().front().lanes : 1;
  std::vector<Entries::iterator> claimed;
  const auto claim_if_missing = [&](const ModelParameters& missing) {
    if (find(missing) == entries_.end()) {
      claimed.push_back(entries_.insert(entries_.end(), {missing, std::nullopt}));
    }
  };
  claim_if_missing(falling);
  for (const ModelParameters& model : ahead) {
    if (claimed.size() >= most || !has_room_ahead()) {
      break;
    }
    const ModelParameters next = fall_model(model);
    if ((!in_lanes || fall_side_by_side(falling, next)) && fault_of(next).empty()) {
      claim_if_missing(next);
    }
  }
  return claimed;
}

void FallCache::solve(const std::vector<Entries::iterator>& claimed,
                      std::unique_lock<std::mutex>& lock) noexcept {
  std::vector<ModelParameters> models;
  for (const auto& entry : claimed) {
    models.push_back(entry->model);
  }
  lock.unlock();
  std::vector<FallOutcome> outcomes = solve_(models);
  lock.lock();
  solved_.notify_all();
  for (std::size_t i = claimed.size(); i-- > 0;) {  // claimed[0] is needed first and kept longest
    usual_bytes_ = std::max(bytes_of(outcomes[i]), usual_bytes_ / 2);
    claimed[i]->outcome = std::move(outcomes[i]);
    entries_.splice(entries_.begin(), entries_, claimed[i]);
  }
  make_room();
}

/// Returns whether unused falls, including those being solved, take less than half of the memory.
bool FallCache::has_room_ahead() const {
  std::size_t bytes = 0;
  for (const Entry& entry : entries_) {
    if (!entry.is_used) {
      bytes += entry.outcome ? bytes_of(*entry.outcome) : usual_bytes_;
    }
  }
  return 2 * bytes < most_bytes_;
}

/// Removes falls, the least recently used first, and those solved ahead and never used last.
void FallCache::make_room() {
  std::size_t falls = 0;
  std::size_t bytes = 0;
  for (const Entry& entry : entries_) {
    falls += entry.outcome ? 1U : 0U;
    bytes += entry.outcome ? bytes_of(*entry.outcome) : 0U;
  }
  for (const bool used : {true, false}) {
    for (auto entry = entries_.end(); entry != entries_.begin();) {
      --entry;
      if (falls <= 1 || bytes <= most_bytes_) {
        return;
      }
      if (entry->outcome && entry->is_used == used) {
        --falls;
        bytes -= bytes_of(*entry->outcome);
        entry = entries_.erase(entry);
      }
    }
  }
}

}  // namespace oblique::solver
