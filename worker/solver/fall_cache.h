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
#include <vector>

#include "worker/solver/model/parameters.h"

namespace oblique::solver {

class FallenChain;  ///< implementation: a chain with its fall

/// A fall, or its error.
struct FallOutcome {
  std::shared_ptr<const FallenChain> fallen;
  std::string error;
};

/// Falls that models share; the least recently used ones are removed. The error of a failed fall is
/// kept, so the fall is not solved again. May be used by several threads at once; the calling
/// threads solve the falls.
class FallCache {
 public:
  using Solve = std::function<std::vector<FallOutcome>(std::span<const ModelParameters>)>;

  /// Keeps at most `most_bytes` of falls, but at least one fall; an error counts as a megabyte.
  /// Solves missing falls by `solve`, which must not throw; by default solve_falls().
  explicit FallCache(std::size_t most_bytes = std::size_t{1} << 30, Solve solve = {});

  /// Returns the fall of `model`, or the error of a model outside its domain. Solves a missing fall
  /// side by side with missing falls of `ahead`, at most one fall per lane. If another thread is
  /// solving the fall of `model`, solves only falls of `ahead`, then waits for that thread.
  FallOutcome fall(const ModelParameters& model, std::span<const ModelParameters> ahead = {});

  /// Returns the falls of `models`. Solves missing ones side by side.
  std::vector<FallOutcome> falls(std::span<const ModelParameters> models);

  /// The fall of `model` if it is kept. Does not solve or wait.
  std::optional<FallOutcome> kept_fall(const ModelParameters& model);

 private:
  struct Entry {
    ModelParameters model;               ///< as returned by fall_model()
    std::optional<FallOutcome> outcome;  ///< empty while the fall is being solved
    bool is_used = false;                ///< whether the fall was returned to a caller
  };
  using Entries = std::list<Entry>;

  Entries::iterator find(const ModelParameters& falling);
  FallOutcome use(Entries::iterator entry);
  std::vector<Entries::iterator> claim(const ModelParameters& falling,
                                       std::span<const ModelParameters> ahead);
  void solve(const std::vector<Entries::iterator>& claimed,
             std::unique_lock<std::mutex>& lock) noexcept;
  bool has_room_ahead() const;
  void make_room();

  const std::size_t most_bytes_;
  Solve solve_;
  std::mutex mutex_;
  std::condition_variable solved_;
  Entries entries_;              ///< most recently used first
  std::size_t usual_bytes_ = 0;  ///< estimated memory of a fall that is being solved
};

}  // namespace oblique::solver
