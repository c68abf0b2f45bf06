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

/// Every parameter of the finger and its solution but H, mu and e*. Defaults are the preset
/// `standard`.
struct ModelParameters {
  std::vector<double> lengths_m{0.4, 0.4, 0.4};  ///< one a link, from the pin O outwards
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
  double dt_s = 0.0;             ///< step in contact; 0: chosen by the tolerance
  double dt_fall_s = 0.0;        ///< step in the fall; 0: chosen for the integrator
  double tolerance = 1e-5;       ///< relative error that chosen steps leave in the outputs
  /// Factor on the step in contact, up to the stability limit. Not a key: only the companions of
  /// error estimates (worker/solver/estimate.h) have another value.
  double step_factor = 1.0;

  bool operator==(const ModelParameters&) const = default;
};

/// Smallest e*. Below, k/e*^2 turns the rounding of the tip's position into forces of newtons, and
/// events follow each other faster than double precision resolves.
inline constexpr double kSmallestRestitution = 1e-3;

/// Range of a parameter of real fingers. 0 is usual wherever it is allowed. A value outside is
/// solved as well, with a note that it may be in another unit.
struct UsualRange {
  double from = 0.0;
  double to = std::numeric_limits<double>::infinity();
};

/// One numeric parameter as users write it: in study files, as an axis, as a flag (`_` becomes
/// `-`), and as a column of the table `models`.
struct ParameterKey {
  std::string_view name;
  std::string_view unit;     ///< SI; empty when dimensionless
  std::string_view meaning;  ///< one line, for help texts
  std::string_view allowed;  ///< the range in words, for help and error messages
  bool (*is_allowed)(double value);
  double (*get)(const ModelParameters&);
  void (*set)(ModelParameters&, double value);
  UsualRange usual = {};
};

/// All numeric model keys in the order of listings. `links` and `length` act on `lengths_m`:
/// `links` keeps the first length for every link, `length` sets all. The integrator's value is its
/// number; `integrator_name` and `integrator_named` translate.
std::span<const ParameterKey> model_keys();

/// The model key called `name`, or nullptr.
const ParameterKey* find_model_key(std::string_view name);

/// The keys of a point: H, mu, e. Their get and set are null.
std::span<const ParameterKey> point_keys();

/// Throws InputError naming key, value and what is allowed, unless `value` is finite and allowed.
void check_value(const ParameterKey& key, double value);

/// "E = 70000 Pa is outside the usual 1e8 to 1e12 Pa; 7e10?" for a value outside the usual range of
/// its key, with the value that a power of 1000 brings into it. Empty for all other values.
std::string note_on_value(const ParameterKey& key, double value);
/// `error` of a fall or a contact, and "; likely cause: E = 70 Pa is outside the usual 1e8 to
/// 1e12 Pa" for each parameter outside its usual range.
std::string with_likely_cause(std::string error, const ModelParameters& model);

/// Throws InputError for the first parameter outside its domain.
void validate(const ModelParameters& model);

/// Throws InputError unless H, mu and e are allowed and H is at most the length of the chain.
void validate_point(const ModelParameters& model, double H_m, double mu, double e_star);

std::string_view integrator_name(Integrator integrator);
/// Throws InputError for an unknown name.
Integrator integrator_named(std::string_view name);
/// In the order of their numbers.
std::span<const std::string_view> integrator_names();

/// The model of a preset: `standard`, `paper`, `printed` or `converged`. Throws InputError for
/// other names.
ModelParameters preset(std::string_view name);
/// The default is the first.
std::span<const std::string_view> preset_names();

/// Mean difference between results on a mesh and on 48 elements a link, over 400 random points [%].
struct MeshAccuracy {
  int elements_per_link;
  double forces_off;
  double duration_off;
  double same_mode;  ///< share of points with the same major mode
};
/// From coarse to fine.
std::span<const MeshAccuracy> mesh_accuracies();

/// `model` with every parameter that its fall does not depend on at its default: k, eta2, dt, a
/// tolerance looser than the default, and spectral_radius without generalized-alpha. Models with
/// equal fall_model() share a fall.
ModelParameters fall_model(const ModelParameters& model);

/// Whether models that differ in this key alone have different falls.
bool changes_fall(const ParameterKey& key, const ModelParameters& model);

/// Hash of fall_model().
std::uint64_t fall_hash(const ModelParameters& model);

/// Falls may use 1/kFallsPartOfMemory of the memory that is available to a process.
inline constexpr std::uint64_t kFallsPartOfMemory = 8;

/// Version of the solver; results of one study come from one version.
std::string solver_version();

}  // namespace oblique::solver
