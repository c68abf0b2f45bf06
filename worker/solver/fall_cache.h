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

class FallenChain;  ///< of the implementation: a chain with its fall

/// A fall, or the reason why there is none.
struct FallOutcome {
  std::shared_ptr<const FallenChain> fallen;
  std::string error;
};

/// Falls that models share; the least recently used ones are removed. A fall that fails is kept as
/// its error, so it fails once. May be used by several threads at once; the calling threads solve
/// the falls.
class FallCache {
 public:
  struct Bounds {
    std::size_t falls = 1024;  ///< at least one is kept
    std::size_t bytes = std::size_t{1} << 30;
  };

  using Solve = std::function<std::vector<FallOutcome>(std::span<const ModelParameters>)>;

  /// Solves missing falls by `solve`, by default solve_falls().
  explicit FallCache(const Bounds& bounds, Solve solve = {});
  /// Keeps at most `most_bytes` of falls, but at least one fall.
  explicit FallCache(std::size_t most_bytes = std::size_t{1} << 30)
      : FallCache(Bounds{.bytes = most_bytes}) {}

  /// The fall of `model`. A missing one is solved, together with the first falls of `ahead` that
  /// are missing, as many as there are lanes; those of `ahead` also while another thread solves
  /// that of `model`. A model outside its domain has an error as its outcome. Exceptions of
  /// `solve`, as std::bad_alloc, are passed on and not kept: the next call solves the fall again.
  FallOutcome fall(const ModelParameters& model, std::span<const ModelParameters> ahead = {});

  /// The falls of all models; missing ones are solved side by side. An exception of `solve` becomes
  /// the error of that fall.
  std::vector<FallOutcome> falls(std::span<const ModelParameters> models);

  /// The fall of `model` if it is kept. Does not solve or wait.
  std::optional<FallOutcome> kept_fall(const ModelParameters& model);

 private:
  struct Entry {
    ModelParameters model;               ///< as returned by fall_model()
    std::optional<FallOutcome> outcome;  ///< empty while it is being solved
    bool is_used = false;                ///< requested, not only solved ahead
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
  Entries entries_;              ///< most recently used first
  std::size_t usual_bytes_ = 0;  ///< of falls solved lately
};

}  // namespace oblique::solver
