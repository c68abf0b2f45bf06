#include "worker/solver/model/parameters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "worker/solver/model/number.h"

#include "worker/solver/model/smallest_restitution.h"

namespace oblique::solver {
namespace {

bool positive(double value) {
  return value > 0.0;
}
bool not_negative(double value) {
  return value >= 0.0;
}
bool is_whole(double value) {
  return value == std::floor(value);
}

constexpr int kMaxLinks = 64;
constexpr int kMaxElementsPerLink = 256;

constexpr std::array<std::string_view, 2> kIntegratorNames{"explicit", "generalized-alpha"};
constexpr std::array<std::string_view, 4> kPresetNames{"standard", "paper", "printed", "converged"};
constexpr std::array<MeshAccuracy, 3> kMeshAccuracies{
    {{4, 3.0, 12.0, 59.0}, {8, 0.15, 1.0, 90.0}, {16, 0.02, 0.07, 98.0}}};
constexpr int kPublishedElements = 4;

using Model = ModelParameters;

/// Below the least, rounding and the location of events leave more; above the largest, modes are
/// not those of the equations, and the stability limit decides anyway.
constexpr double kLeastTolerance = 1e-9;
constexpr double kLargestTolerance = 1e-2;

constexpr std::array<ParameterKey, 16> kModelKeys{{
    {"links", "", "number of links", "a whole number from 1 to 64",
     [](double v) { return is_whole(v) && v >= 1 && v <= kMaxLinks; },
     [](const Model& m) { return static_cast<double>(m.lengths_m.size()); },
     [](Model& m, double v) {
       m.lengths_m.assign(static_cast<std::size_t>(v), m.lengths_m.front());
     }},
    {"length", "m", "length of every link", "> 0", positive,
     [](const Model& m) { return m.lengths_m.front(); },
     [](Model& m, double v) { std::fill(m.lengths_m.begin(), m.lengths_m.end(), v); }},
    {"E", "Pa", "Young's modulus", "> 0", positive, [](const Model& m) { return m.E_Pa; },
     [](Model& m, double v) { m.E_Pa = v; }},
    {"A", "m^2", "cross-section area", "> 0", positive, [](const Model& m) { return m.A_m2; },
     [](Model& m, double v) { m.A_m2 = v; }},
    {"I", "m^4", "second moment of area", "> 0", positive, [](const Model& m) { return m.I_m4; },
     [](Model& m, double v) { m.I_m4 = v; }},
    {"rho", "kg/m^3", "density", "> 0", positive, [](const Model& m) { return m.rho_kg_m3; },
     [](Model& m, double v) { m.rho_kg_m3 = v; }},
    {"g", "m/s^2", "gravity, downwards", "> 0", positive, [](const Model& m) { return m.g_m_s2; },
     [](Model& m, double v) { m.g_m_s2 = v; }},
    {"elements_per_link", "", "elements a link", "a whole number from 1 to 256",
     [](double v) { return is_whole(v) && v >= 1 && v <= kMaxElementsPerLink; },
     [](const Model& m) { return static_cast<double>(m.elements_per_link); },
     [](Model& m, double v) { m.elements_per_link = static_cast<int>(v); }},
    {"k", "N/m", "normal contact stiffness in compression", "> 0", positive,
     [](const Model& m) { return m.k_N_m; }, [](Model& m, double v) { m.k_N_m = v; }},
    {"eta2", "", "ratio of normal to tangential contact stiffness", "> 0", positive,
     [](const Model& m) { return m.eta2; }, [](Model& m, double v) { m.eta2 = v; }},
    {"tip_mass", "kg", "point mass at the tip", ">= 0", not_negative,
     [](const Model& m) { return m.tip_mass_kg; }, [](Model& m, double v) { m.tip_mass_kg = v; }},
    {"integrator", "", "how the equations of motion are stepped", "explicit or generalized-alpha",
     [](double v) { return is_whole(v) && v >= 0 && v < double{kIntegratorNames.size()}; },
     [](const Model& m) { return static_cast<double>(m.integrator); },
     [](Model& m, double v) { m.integrator = static_cast<Integrator>(v); }},
    {"spectral_radius", "", "of generalized-alpha at infinite frequency",
     ">= 0 and < 1 (at 1 nothing damps the multipliers, and they never settle)",
     [](double v) { return v >= 0.0 && v < 1.0; }, [](const Model& m) { return m.spectral_radius; },
     [](Model& m, double v) { m.spectral_radius = v; }},
    {"dt", "s", "step in contact; 0: chosen by the tolerance", ">= 0", not_negative,
     [](const Model& m) { return m.dt_s; }, [](Model& m, double v) { m.dt_s = v; }},
    {"dt_fall", "s", "step in the fall; 0: chosen for the integrator", ">= 0", not_negative,
     [](const Model& m) { return m.dt_fall_s; }, [](Model& m, double v) { m.dt_fall_s = v; }},
    {"tolerance", "", "relative error that chosen steps leave in the outputs of a contact",
     "from 1e-9 (rounding leaves more below) to 0.01 (modes mean nothing above)",
     [](double v) { return v >= kLeastTolerance && v <= kLargestTolerance; },
     [](const Model& m) { return m.tolerance; }, [](Model& m, double v) { m.tolerance = v; }},
}};

constexpr std::array<ParameterKey, 3> kPointKeys{{
    {"H", "m", "drop of the tip at touch", "> 0 and at most the largest drop of the tip", positive,
     nullptr, nullptr},
    {"mu", "", "coefficient of friction", ">= 0", not_negative, nullptr, nullptr},
    {"e", "", "Stronge's energetic coefficient of restitution", "in [0.001, 1]",
     [](double v) { return v >= kSmallestRestitution && v <= 1.0; }, nullptr, nullptr},
}};

template <std::size_t n>
std::string joined(const std::array<std::string_view, n>& names) {
  std::string text;
  for (const auto name : names) {
    text += (text.empty() ? "" : ", ");
    text += name;
  }
  return text;
}

}  // namespace

std::span<const ParameterKey> model_keys() {
  return kModelKeys;
}

const ParameterKey* find_model_key(std::string_view name) {
  const auto found = std::find_if(kModelKeys.begin(), kModelKeys.end(),
                                  [&](const auto& k) { return k.name == name; });
  return found == kModelKeys.end() ? nullptr : &*found;
}

std::span<const ParameterKey> point_keys() {
  return kPointKeys;
}

void check_value(const ParameterKey& key, double value) {
  if (std::isfinite(value) && key.is_allowed(value)) {
    return;
  }
  const std::string name(key.name);
  std::string message = name + " = " + exact_number(value);
  if (!key.unit.empty()) {
    message += ' ';
    message += key.unit;
  }
  throw InputError(name, message + " is not allowed: " + name + " must be " +
                             (std::isfinite(value) ? "" : "finite and ") +
                             std::string(key.allowed));
}

void validate(const ModelParameters& model) {
  if (model.lengths_m.empty() || model.lengths_m.size() > kMaxLinks) {
    throw InputError("lengths", "lengths has " + std::to_string(model.lengths_m.size()) +
                                    " values: it must have one a link, from 1 to " +
                                    std::to_string(kMaxLinks));
  }
  for (const double length_m : model.lengths_m) {
    check_value(*find_model_key("length"), length_m);
  }
  for (const auto& key : kModelKeys) {
    check_value(key, key.get(model));
  }
}

void validate_point(const ModelParameters& model, double H_m, double mu, double e_star) {
  check_value(kPointKeys[0], H_m);
  check_value(kPointKeys[1], mu);
  check_value(kPointKeys[2], e_star);
  const double reach_m = std::accumulate(model.lengths_m.begin(), model.lengths_m.end(), 0.0);
  if (H_m > reach_m) {
    throw InputError("H", "H = " + exact_number(H_m) +
                              " m is not allowed: the tip drops at most the length of the chain, " +
                              readable_number(reach_m, 10) + " m");
  }
}

std::string_view integrator_name(Integrator integrator) {
  return kIntegratorNames.at(static_cast<std::size_t>(integrator));
}

Integrator integrator_named(std::string_view name) {
  const auto found = std::find(kIntegratorNames.begin(), kIntegratorNames.end(), name);
  if (found == kIntegratorNames.end()) {
    throw InputError("integrator", "integrator = \"" + std::string(name) +
                                       "\" is not allowed: integrator must be " +
                                       joined(kIntegratorNames));
  }
  return static_cast<Integrator>(found - kIntegratorNames.begin());
}

std::span<const std::string_view> integrator_names() {
  return kIntegratorNames;
}

ModelParameters preset(std::string_view name) {
  ModelParameters model;
  if (name == "paper") {
    model.elements_per_link = kPublishedElements;
  } else if (name == "printed") {
    model.elements_per_link = kPublishedElements;
    model.A_m2 = 5e-4;
    model.I_m4 = 2e-8;
    model.k_N_m = 2.5e7;
    model.eta2 = 1.21;
  } else if (name == "converged") {
    model.elements_per_link = 48;
  } else if (name != kPresetNames[0]) {
    throw InputError("preset", "preset = \"" + std::string(name) +
                                   "\" is not allowed: preset must be " + joined(kPresetNames));
  }
  return model;
}

std::span<const std::string_view> preset_names() {
  return kPresetNames;
}

std::span<const MeshAccuracy> mesh_accuracies() {
  return kMeshAccuracies;
}

}  // namespace oblique::solver
