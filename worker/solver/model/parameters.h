#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "worker/solver/model/errors.h"

namespace oblique::solver {

/// How the equations of motion are stepped (worker/solver/reference/theory.md).
enum class Integrator {
  kExplicit,          ///< joints eliminated, PEFRL: explicit, symplectic, order 4
  kGeneralizedAlpha,  ///< joints as constraints with multipliers, generalized-alpha: order 2
};

/// All parameters except H, mu and e*. Defaults are the preset `standard`.
struct ModelParameters {
  std::vector<double> lengths_m{0.4, 0.4, 0.4};  ///< of the links, from the pin O outwards
  double E_Pa = 70e9;                            ///< Young's modulus
  double A_m2 = 5.309e-4;                        ///< cross-section area
  double I_m4 = 2.243e-8;                        ///< second moment of area
  double rho_kg_m3 = 2700.0;                     ///< density
  double g_m_s2 = 9.81;                          ///< gravity, downwards
  int elements_per_link = 16;
  double k_N_m = 2.7e7;      ///< normal contact stiffness in compression
  double eta2 = 1.2463;      ///< ratio of normal to tangential contact stiffness
  double tip_mass_kg = 0.0;  ///< point mass carried by the tip node
  Integrator integrator = Integrator::kExplicit;
  double spectral_radius = 0.9;  ///< of generalized-alpha at infinite frequency
  double dt_s = 0.0;             ///< step in contact; if 0, the tolerance determines it
  double dt_fall_s = 0.0;        ///< step in the fall; if 0, it is chosen for the integrator
  double tolerance = 1e-5;       ///< relative error of outputs that chosen steps may cause
  double step_factor = 1.0;      ///< factor on the step in contact; 1 except in companion_model()

  bool operator==(const ModelParameters&) const = default;
};

/// Smallest e*. Below it, k/e*^2 turns rounding of the tip's position into forces of newtons.
inline constexpr double kSmallestRestitution = 1e-3;

/// Range of a parameter in real fingers. 0 is usual too where it is allowed. Values outside are
/// solved, with a note that they may be in another unit.
struct UsualRange {
  double from = 0.0;
  double to = std::numeric_limits<double>::infinity();
};

/// When the value of a parameter affects the fall. kBelowDefault: larger values have the same fall.
enum class FallEffect : std::uint8_t { kAlways, kNever, kBelowDefault, kWithGeneralizedAlpha };

/// One numeric parameter: a key of study files, an axis, a flag (`_` becomes `-`) and a column of
/// the table `models`.
struct ParameterKey {
  std::string_view name;
  std::string_view unit;     ///< SI; empty when dimensionless
  std::string_view meaning;  ///< one line, for help texts
  std::string_view allowed;  ///< the range in words, for help and error messages
  bool (*is_allowed)(double value);
  double (*get)(const ModelParameters&);
  void (*set)(ModelParameters&, double value);
  UsualRange usual = {};
  FallEffect fall_effect = FallEffect::kAlways;
};

/// All numeric model keys in the order of listings. Setting `links` gives every link the first
/// length of `lengths_m`. Setting `length` gives every link that length. The value of `integrator`
/// is the number of the enumerator.
std::span<const ParameterKey> model_keys();

/// Returns nullptr for an unknown name.
const ParameterKey* find_model_key(std::string_view name);

/// The keys of a point: H, mu, e. Their get and set are null.
std::span<const ParameterKey> point_keys();

/// Throws InputError unless `value` is finite and allowed.
void check_value(const ParameterKey& key, double value);

/// "E = 70000 Pa is outside the usual 1e8 to 1e12 Pa; 7e10?": a note on a value outside its usual
/// range, with the value times a power of 1000 that is inside. Empty for usual values.
std::string note_on_value(const ParameterKey& key, double value);
/// Appends "; likely cause: E = 70 Pa is outside the usual 1e8 to 1e12 Pa" to the error of a fall
/// or a contact, for each parameter outside its usual range.
std::string with_likely_cause(std::string error, const ModelParameters& model);

/// Throws InputError for the first parameter that is not allowed.
void validate(const ModelParameters& model);

/// Throws InputError unless H, mu and e are allowed and H is at most the length of the chain.
void validate_point(const ModelParameters& model, double H_m, double mu, double e_star);

std::string_view integrator_name(Integrator integrator);
/// Throws InputError for an unknown name.
Integrator integrator_named(std::string_view name);
/// Returns the names in the order of the enumerators.
std::span<const std::string_view> integrator_names();

/// Returns the preset `standard`, `paper`, `printed` or `converged`; throws InputError for others.
ModelParameters preset(std::string_view name);
/// The default preset comes first.
std::span<const std::string_view> preset_names();

/// Mean differences of results of 400 random points between a mesh and 48 elements per link [%].
struct MeshAccuracy {
  int elements_per_link;
  double forces_off;
  double duration_off;
  double same_mode;  ///< share of points with the same major mode
};
/// Returns the accuracies from coarse to fine meshes.
std::span<const MeshAccuracy> mesh_accuracies();

/// `model` with the default of every parameter that does not affect its fall (FallEffect). Models
/// with equal fall_model() share a fall.
ModelParameters fall_model(const ModelParameters& model);

/// Returns whether models with the integrator of `model` that differ only in this key may have
/// different falls.
bool changes_fall(const ParameterKey& key, const ModelParameters& model);

/// Hash of fall_model().
std::uint64_t fall_hash(const ModelParameters& model);

/// Falls may use 1/kFallsPartOfMemory of the memory available to the process.
inline constexpr std::uint64_t kFallsPartOfMemory = 8;

/// Version of the solver; results of one study come from one version.
std::string solver_version();

}  // namespace oblique::solver
