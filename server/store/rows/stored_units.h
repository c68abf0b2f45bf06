#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "worker/solver/model/case_result.h"
#include "worker/solver/model/parameters.h"

// Outputs as the table `packed_results` has them: as whole multiples of small units, with the
// digits that their accuracy carries and a hundred times less. README.md says which and why.
namespace oblique::server {

/// What an output is measured by where its accuracy is a fraction of something.
enum class Scale {
  kFall,
  kReach,
  kSpeed,
  kDuration,
  kForce,
  kImpulse,
  kPath,
  kApproach,
  kWork,
  kStep,
  kOne
};
inline constexpr std::size_t kScales = 11;

/// A number of `packed_results`: `per_unit` times the one that views show.
struct StoredUnit {
  std::string_view column;  ///< of the views
  std::string_view stored;  ///< of `packed_results`
  double per_unit;
  Scale scale = Scale::kOne;
  bool follows_accuracy = true;  ///< false: whole whatever the model asks for
};

/// Those of all real outputs, in the order of solver::result_fields().
std::span<const StoredUnit> stored_units();

/// Of the instants and the forces in lists.
inline constexpr StoredUnit kListTime{"t_s", "", 1e12, Scale::kDuration};
inline constexpr StoredUnit kListForce{"fn_N", "", 1e5, Scale::kForce};

/// The relative accuracy that outputs of a model may have; 0 where that cannot be told, as when the
/// step is given, so that no digit may be lost.
double accuracy_of(const solver::ModelParameters& model);

/// How finely the numbers of one result are stored.
class StoredDigits {
 public:
  StoredDigits(const solver::CaseResult& result, double accuracy);

  /// Decimals of the multiple of a unit that are kept; 0: it is whole. `kAllDigits`: every bit.
  int decimals(const StoredUnit& unit) const;
  static constexpr int kAllDigits = -1;

 private:
  double accuracy_;
  std::array<double, kScales> scales_;
};

}  // namespace oblique::server
