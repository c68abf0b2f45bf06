#include "worker/solver/model/parameters.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <set>
#include <type_traits>

#include "worker/solver/model/number.h"

namespace oblique::solver {
namespace {

bool positive(double value) {
  return value > 0.0;
}
bool not_negative(double value) {
  return value >= 0.0;
}
template <int from, int to>
bool is_whole(double value) {
  return value == std::floor(value) && value >= from && value <= to;
}

constexpr int kMaxLinks = 64;

constexpr std::array<std::string_view, 2> kIntegratorNames{"explicit", "generalized-alpha"};
constexpr std::array<std::string_view, 4> kPresetNames{"standard", "paper", "printed", "converged"};
constexpr std::array<MeshAccuracy, 3> kMeshAccuracies{
    {{4, 3.0, 12.0, 59.0}, {8, 0.15, 1.0, 90.0}, {16, 0.02, 0.07, 98.0}}};

using Model = ModelParameters;

template <auto member>
constexpr ParameterKey key(std::string_view name, std::string_view unit, std::string_view meaning,
                           std::string_view allowed, bool (*is_allowed)(double),
                           const UsualRange& usual = {},
                           FallEffect fall_effect = FallEffect::kAlways) {
  const auto get = [](const Model& model) { return static_cast<double>(model.*member); };
  const auto set = [](Model& model, double value) {
    model.*member = static_cast<std::remove_cvref_t<decltype(model.*member)>>(value);
  };
  return {name, unit, meaning, allowed, is_allowed, get, set, usual, fall_effect};
}

constexpr std::array<ParameterKey, 16> kModelKeys{{
    {"links", "", "number of links", "a whole number from 1 to 64", is_whole<1, kMaxLinks>,
     [](const Model& m) { return static_cast<double>(m.lengths_m.size()); },
     [](Model& m, double v) {
       m.lengths_m.assign(static_cast<std::size_t>(v), m.lengths_m.front());
     }},
    {"length", "m", "length of every link", "> 0", positive,
     [](const Model& m) { return m.lengths_m.front(); },
     [](Model& m, double v) { std::fill(m.lengths_m.begin(), m.lengths_m.end(), v); },
     UsualRange{1e-3, 100.0}},
    key<&Model::E_Pa>("E", "Pa", "Young's modulus", "> 0", positive, {1e8, 1e12}),
    key<&Model::A_m2>("A", "m^2", "cross-section area", "> 0", positive, {1e-8, 1.0}),
    key<&Model::I_m4>("I", "m^4", "second moment of area", "> 0", positive, {1e-17, 0.1}),
    key<&Model::rho_kg_m3>("rho", "kg/m^3", "density", "> 0", positive, {100.0, 25'000.0}),
    key<&Model::g_m_s2>("g", "m/s^2", "gravity, downwards", "> 0", positive, {0.1, 100.0}),
    key<&Model::elements_per_link>("elements_per_link", "", "elements a link",
                                   "a whole number from 1 to 256", is_whole<1, 256>),
    key<&Model::k_N_m>("k", "N/m", "normal contact stiffness in compression", "> 0", positive,
                       {1e4, 1e10}, FallEffect::kNever),
    key<&Model::eta2>("eta2", "", "ratio of normal to tangential contact stiffness", "> 0",
                      positive, {0.1, 10.0}, FallEffect::kNever),
    key<&Model::tip_mass_kg>("tip_mass", "kg", "point mass at the tip", ">= 0", not_negative,
                             {1e-6, 10.0}),
    key<&Model::integrator>("integrator", "", "how the equations of motion are stepped",
                            "explicit or generalized-alpha",
                            is_whole<0, static_cast<int>(kIntegratorNames.size()) - 1>),
    key<&Model::spectral_radius>(
        "spectral_radius", "", "spectral radius of generalized-alpha at infinite frequency",
        ">= 0 and < 1 (at 1 nothing damps the multipliers, and they never settle)",
        [](double v) { return v >= 0.0 && v < 1.0; }, {}, FallEffect::kWithGeneralizedAlpha),
    key<&Model::dt_s>("dt", "s", "step in contact; 0: chosen by the tolerance", ">= 0",
                      not_negative, {}, FallEffect::kNever),
    key<&Model::dt_fall_s>("dt_fall", "s", "step in the fall; 0: chosen for the integrator", ">= 0",
                           not_negative),
    key<&Model::tolerance>(
        "tolerance", "", "relative error that chosen steps leave in the outputs of a contact",
        "from 1e-9 (rounding leaves more below) to 0.01 (modes mean nothing above)",
        [](double v) { return v >= 1e-9 && v <= 1e-2; }, {}, FallEffect::kBelowDefault),
}};

constexpr std::array<ParameterKey, 3> kPointKeys{{
    {"H", "m", "drop of the tip at touch", "> 0 and at most the largest drop of the tip", positive,
     nullptr, nullptr, UsualRange{1e-4, 10.0}},
    {"mu", "", "coefficient of friction", ">= 0", not_negative, nullptr, nullptr,
     UsualRange{0.0, 5.0}},
    {"e", "", "Stronge's energetic coefficient of restitution", "in [0.001, 1]",
     [](double v) { return v >= kSmallestRestitution && v <= 1.0; }, nullptr, nullptr},
}};

/// The index of `name` in `names`. Throws InputError about `key` for an unknown name.
std::size_t index_of(std::string_view name, std::span<const std::string_view> names,
                     const std::string& key) {
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) {
    return static_cast<std::size_t>(found - names.begin());
  }
  std::string text = key + " = \"" + std::string(name) + "\" is not allowed: " + key + " must be ";
  for (const std::string_view allowed : names) {
    text.append(allowed == names.front() ? "" : ", ").append(allowed);
  }
  throw InputError(key, text);
}

bool is_usual(const ParameterKey& key, double value) {
  return value == 0.0 || !std::isfinite(value) || !key.is_allowed(value) ||
         (value >= key.usual.from && value <= key.usual.to);
}

/// Formats 7e+10 as 7e10.
std::string short_number(double value) {
  std::string text = readable_number(value);
  if (auto exponent = text.find('e') + 1; exponent != 0) {  // after the e
    exponent += text[exponent] == '-' ? 1U : 0U;
    text.erase(exponent, text.find_first_not_of("+0", exponent) - exponent);
  }
  return text;
}

std::string with_unit(const ParameterKey& key, double value) {
  return short_number(value) + (key.unit.empty() ? "" : " ") + std::string(key.unit);
}

std::string outside_usual(const ParameterKey& key, double value) {
  return std::string(key.name) + " = " + with_unit(key, value) + " is outside the usual " +
         short_number(key.usual.from) + " to " + with_unit(key, key.usual.to);
}

/// Returns `value` times the power of 1000 that brings it nearest to the middle of the usual range,
/// if the product is in this range and the key has a unit.
std::optional<double> in_another_unit(const ParameterKey& key, double value) {
  const auto& [from, to] = key.usual;
  const double middle = std::sqrt(from * to);
  std::optional<double> best;
  for (int power = -12; power <= 12 && !key.unit.empty(); power += 3) {
    // Dividing by 10^n rounds once. Multiplying by 10^-n, which is not exact, rounds twice.
    const double other = power < 0 ? value / std::pow(10.0, -power) : value * std::pow(10.0, power);
    if (other >= from && other <= to &&
        (!best || std::abs(std::log(other / middle)) < std::abs(std::log(*best / middle)))) {
      best = other;
    }
  }
  return best;
}

}  // namespace

std::span<const ParameterKey> model_keys() {
  return kModelKeys;
}

const ParameterKey* find_model_key(std::string_view name) {
  const auto* found = std::ranges::find(kModelKeys, name, &ParameterKey::name);
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
  const std::string unit = (key.unit.empty() ? "" : " ") + std::string(key.unit);
  throw InputError(name, name + " = " + exact_number(value) + unit + " is not allowed: " + name +
                             " must be " + (std::isfinite(value) ? "" : "finite and ") +
                             std::string(key.allowed));
}

void validate(const ModelParameters& model) {
  if (model.lengths_m.empty() || model.lengths_m.size() > kMaxLinks) {
    throw InputError("lengths", "lengths has " + std::to_string(model.lengths_m.size()) +
                                    " values: it must have one per link, from 1 to " +
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
  return static_cast<Integrator>(index_of(name, kIntegratorNames, "integrator"));
}

std::span<const std::string_view> integrator_names() {
  return kIntegratorNames;
}

ModelParameters preset(std::string_view name) {
  ModelParameters model;
  constexpr std::array kElementsPerLink{16, 4, 4, 48};
  model.elements_per_link = kElementsPerLink[index_of(name, kPresetNames, "preset")];
  if (name == "printed") {
    model.A_m2 = 5e-4;
    model.I_m4 = 2e-8;
    model.k_N_m = 2.5e7;
    model.eta2 = 1.21;
  }
  return model;
}

std::span<const std::string_view> preset_names() {
  return kPresetNames;
}

std::span<const MeshAccuracy> mesh_accuracies() {
  return kMeshAccuracies;
}

std::string note_on_value(const ParameterKey& key, double value) {
  if (is_usual(key, value)) {
    return {};
  }
  const auto other = in_another_unit(key, value);
  return outside_usual(key, value) + (other ? "; " + short_number(*other) + "?" : "");
}

std::string with_likely_cause(std::string error, const ModelParameters& model) {
  for (const auto& key : model_keys()) {
    std::set<double> values{key.get(model)};
    if (key.name == "length") {
      const auto [least, largest] = std::ranges::minmax(model.lengths_m);
      values = {least, largest};
    }
    for (const double value : values) {
      if (!is_usual(key, value)) {
        error += "; likely cause: " + outside_usual(key, value);
      }
    }
  }
  return error;
}

ModelParameters fall_model(const ModelParameters& model) {
  const ModelParameters defaults;
  ModelParameters falling = model;
  falling.step_factor = defaults.step_factor;
  for (const auto& key : kModelKeys) {
    const double usual = key.get(defaults);
    if (!changes_fall(key, model) ||
        (key.fall_effect == FallEffect::kBelowDefault && key.get(model) > usual)) {
      key.set(falling, usual);
    }
  }
  return falling;
}

bool changes_fall(const ParameterKey& key, const ModelParameters& model) {
  return key.fall_effect == FallEffect::kWithGeneralizedAlpha
             ? model.integrator == Integrator::kGeneralizedAlpha
             : key.fall_effect != FallEffect::kNever;
}

std::uint64_t fall_hash(const ModelParameters& model) {
  constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15;  // 2^64 over the golden ratio
  const ModelParameters falling = fall_model(model);
  std::uint64_t hash = 0;
  const auto add = [&hash](double value) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * kOdd;
    hash ^= hash >> 32;
  };
  std::for_each(falling.lengths_m.begin(), falling.lengths_m.end(), add);
  for (const auto& key : model_keys()) {
    add(key.get(falling));
  }
  add(falling.step_factor);
  return hash;
}

std::string solver_version() {
  return OBLIQUE_SOLVER_VERSION;
}

}  // namespace oblique::solver
