#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "worker/solver/model/parameters.h"

namespace oblique::solver {

class FallenChain;  ///< of the implementation: a chain with its fall (falls.h)

/// A fall, or the reason why there is none.
struct FallOutcome {
  std::shared_ptr<const FallenChain> fallen;
  std::string error;
};

/// Falls that models share. Keeps those used last; one that fails is kept as its error,
/// so it fails once. What the solution throws, as where memory is short, is not kept: it leaves
/// `fall`, and the next call solves it anew. May be used by several threads at once; falls are
/// solved by the threads that call.
class FallCache {
 public:
  struct Bounds {
    std::size_t falls = 1024;  ///< at least one is kept
    std::size_t bytes = std::size_t{1} << 30;
  };

  using Solve = std::function<std::vector<FallOutcome>(std::span<const ModelParameters>)>;

  /// Solves missing falls by `solve`, or by solve_falls().
  explicit FallCache(const Bounds& bounds, Solve solve = {});
  /// Keeps at most so many bytes of falls, the last one aside.
  explicit FallCache(std::size_t most_bytes = std::size_t{1} << 30)
      : FallCache(Bounds{.bytes = most_bytes}) {}

  /// The fall of `model`; fall_model() need not have gone through. What is not kept is solved, and
  /// beside it, as far as lanes go, those of `ahead`, the first first, that nobody has solved or is
  /// solving; when another thread solves that of `model`, those of `ahead` are solved while it
  /// does. Does not wait for falls of `ahead` that others solve. A model outside its domain fails
  /// with what is wrong with it.
  FallOutcome fall(const ModelParameters& model, std::span<const ModelParameters> ahead = {});

  /// One fall for each model; those that are missing are solved side by side. One for which there
  /// is no memory just then fails.
  std::vector<FallOutcome> falls(std::span<const ModelParameters> models);

  /// The fall of `model` when it is kept; solves and waits for nothing.
  std::optional<FallOutcome> kept_fall(const ModelParameters& model);

 private:
  struct Entry {
    ModelParameters model;               ///< as fall_model() gives it
    std::optional<FallOutcome> outcome;  ///< empty while it is being solved
    bool is_used = false;                ///< somebody asked for it, not only ahead of others
  };
  using Entries = std::list<Entry>;

  Entries::iterator find(const ModelParameters& falling);
  FallOutcome use(Entries::iterator entry);
  std::vector<Entries::iterator> claim(const ModelParameters& falling,
                                       std::span<const ModelParameters> ahead);
  void solve(const std::vector<Entries::iterator>& claimed, std::unique_lock<std::mutex>& lock);
  bool has_room_ahead() const;
  void make_room();

  const Bounds bounds_;
  Solve solve_;
  std::mutex mutex_;
  std::condition_variable solved_;
  Entries entries_;              ///< the one used last comes first
  std::size_t usual_bytes_ = 0;  ///< of falls solved lately
};

}  // namespace oblique::solver
