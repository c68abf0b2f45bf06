#include "worker/solver/falls.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <iterator>
#include <map>
#include <new>
#include <string>
#include <tuple>
#include <utility>

#include "worker/solver/fast/kernels.h"
#include "worker/solver/fast/lane_falls.h"
#include "worker/solver/model/errors.h"
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

/// Solves falls, all in one way and of one shape.
std::vector<FallSolution> solve(WayToFall way, std::span<const FallRequest> requests) {
  if (way != WayToFall::kStepsAlone) {
    return way == WayToFall::kSteps ? solve_by_steps(requests) : solve_by_collocation(requests);
  }
  std::vector<FallSolution> solutions(requests.size());
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const FallRequest& request = requests[i];
    try {
      solutions[i].fall = solve_stepped_fall(request.motion, request.dt_s,
                                             longest_fall_s(*request.chain), request.progress);
    } catch (const std::bad_alloc&) {  // says nothing of this fall
      throw;
    } catch (const std::exception& error) {
      solutions[i].error = error.what();
    }
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

// ---- FallCache ----------------------------------------------------------------------------------

namespace {

std::size_t bytes_of(const std::optional<FallOutcome>& outcome) {
  return outcome && outcome->fallen ? outcome->fallen->fall().bytes() : 0;
}

/// Why this is no model; empty: it is one. One with a NaN, which equals nothing, would never be
/// found among those that are kept.
std::string fault_of(const ModelParameters& falling) {
  try {
    validate(falling);
    return {};
  } catch (const InputError& error) {
    return error.what();
  }
}

}  // namespace

FallCache::FallCache(const Bounds& bounds, Solve solve)
    : bounds_(bounds), solve_(std::move(solve)) {
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
      solved_.wait(lock);  // and look again: it may have been solved and forgotten meanwhile
    } else {
      solve(claimed, lock);
    }
  }
}

std::vector<FallOutcome> FallCache::falls(std::span<const ModelParameters> models) {
  std::vector<FallOutcome> outcomes;
  for (std::size_t i = 0; i < models.size(); ++i) {
    try {
      outcomes.push_back(fall(models[i], models.subspan(i + 1)));
    } catch (const std::exception& error) {
      outcomes.push_back({nullptr, error.what()});
    }
  }
  return outcomes;
}

std::optional<FallOutcome> FallCache::kept_fall(const ModelParameters& model) {
  const ModelParameters falling = fall_model(model);
  const std::lock_guard lock(mutex_);
  const auto found = find(falling);
  if (found == entries_.end() || !found->outcome) {
    return std::nullopt;
  }
  return use(found);
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

/// Makes entries for what this thread is to solve now: none when others solve it all.
std::vector<FallCache::Entries::iterator> FallCache::claim(const ModelParameters& falling,
                                                           std::span<const ModelParameters> ahead) {
  const bool in_lanes = fall_side_by_side(falling, falling);
  const std::size_t most = in_lanes ? runnable_lane_kernels().front().lanes : 1;
  std::vector<Entries::iterator> claimed;
  const auto claim_if_missing = [&](const ModelParameters& missing) {
    if (find(missing) == entries_.end()) {
      entries_.push_back({missing, std::nullopt});
      claimed.push_back(std::prev(entries_.end()));
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
                      std::unique_lock<std::mutex>& lock) {
  std::vector<FallOutcome> outcomes;
  try {
    std::vector<ModelParameters> models;
    models.reserve(claimed.size());
    for (const auto& entry : claimed) {
      models.push_back(entry->model);
    }
    lock.unlock();
    outcomes = solve_(models);
  } catch (...) {  // no memory just then: others wait for these entries, and may have more luck
    if (!lock.owns_lock()) {
      lock.lock();
    }
    for (const auto& entry : claimed) {
      entries_.erase(entry);
    }
    solved_.notify_all();
    throw;
  }
  lock.lock();
  for (std::size_t i = claimed.size(); i-- > 0;) {  // the one wanted first is to stay longest
    claimed[i]->outcome = std::move(outcomes[i]);
    usual_bytes_ = std::max(bytes_of(claimed[i]->outcome), usual_bytes_ / 2);
    entries_.splice(entries_.begin(), entries_, claimed[i]);
  }
  make_room();
  solved_.notify_all();
}

/// Falls solved ahead, and those under way, may take half of the room.
bool FallCache::has_room_ahead() const {
  std::size_t falls = 0;
  std::size_t bytes = 0;
  for (const Entry& entry : entries_) {
    if (!entry.is_used) {
      ++falls;
      bytes += entry.outcome ? bytes_of(entry.outcome) : usual_bytes_;
    }
  }
  return 2 * falls < bounds_.falls && 2 * bytes < bounds_.bytes;
}

/// Forgets what was not used for longest, of falls solved ahead only when no other are left.
void FallCache::make_room() {
  std::size_t falls = 0;
  std::size_t bytes = 0;
  for (const Entry& entry : entries_) {
    falls += entry.outcome ? 1U : 0U;
    bytes += bytes_of(entry.outcome);
  }
  for (const bool used : {true, false}) {
    for (auto entry = entries_.end(); entry != entries_.begin();) {
      --entry;
      if (falls <= 1 || (falls <= bounds_.falls && bytes <= bounds_.bytes)) {
        return;
      }
      if (entry->outcome && entry->is_used == used) {
        --falls;
        bytes -= bytes_of(entry->outcome);
        entry = entries_.erase(entry);
      }
    }
  }
}

}  // namespace oblique::solver
