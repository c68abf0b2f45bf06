#include "proto/recipe/model_message.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <utility>

#include <sodium/crypto_hash_sha256.h>
#include <sodium/utils.h>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/blocks.h"
#include "proto/text.h"
#include "proto/wire/frame_scan.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

using solver::exact_number;
using solver::InputError;

using Model = solver::ModelParameters;
using Message = ModelParameters;
using Field = std::tuple<double Model::*, double (Message::*)() const, void (Message::*)(double)>;

/// The numeric members of a model, and their fields in the message.
constexpr std::array<Field, 12> kFields{{
    {&Model::E_Pa, &Message::e_pa, &Message::set_e_pa},
    {&Model::A_m2, &Message::a_m2, &Message::set_a_m2},
    {&Model::I_m4, &Message::i_m4, &Message::set_i_m4},
    {&Model::rho_kg_m3, &Message::rho_kg_m3, &Message::set_rho_kg_m3},
    {&Model::g_m_s2, &Message::g_m_s2, &Message::set_g_m_s2},
    {&Model::k_N_m, &Message::k_n_m, &Message::set_k_n_m},
    {&Model::eta2, &Message::eta2, &Message::set_eta2},
    {&Model::tip_mass_kg, &Message::tip_mass_kg, &Message::set_tip_mass_kg},
    {&Model::dt_s, &Message::dt_s, &Message::set_dt_s},
    {&Model::dt_fall_s, &Message::dt_fall_s, &Message::set_dt_fall_s},
    {&Model::spectral_radius, &Message::spectral_radius, &Message::set_spectral_radius},
    {&Model::tolerance, &Message::tolerance, &Message::set_tolerance},
}};

std::string comparable_bytes(Block block) {
  block.DiscardUnknownFields();
  return block.SerializeAsString();
}

Axis axis_of(const solver::ParameterKey& key) {
  Axis axis;
  axis.set_key(std::string(key.name));
  return axis;
}

constexpr std::array<std::string_view, 3> kDistributions{"uniform", "log-uniform", "normal"};
constexpr std::array<std::string_view, 3> kSamples{"random", "lhs", "sobol"};

int number_of_name(std::string_view name, std::span<const std::string_view> names,
                   std::string_view key) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw InputError(key, fmt::format("unknown {} \"{}\"{}: it must be one of {}", key,
                                      excerpt(name), did_you_mean(name, names), joined(names)));
  }
  return static_cast<int>(found - names.begin());
}

}  // namespace

ModelParameters to_message(const solver::ModelParameters& model) {
  ModelParameters message;
  message.mutable_lengths_m()->Assign(model.lengths_m.begin(), model.lengths_m.end());
  message.set_elements_per_link(static_cast<std::uint32_t>(model.elements_per_link));
  message.set_integrator(static_cast<std::uint32_t>(model.integrator));
  for (const auto& [member, get, set] : kFields) {
    (message.*set)(model.*member);
  }
  return message;
}

solver::ModelParameters from_message_unchecked(const ModelParameters& message) {
  // elements_per_link and integrator are checked before the conversion, because their values may
  // not fit into the struct's members (`int` and an enumeration).
  solver::check_value(model_key("elements_per_link"), message.elements_per_link());
  solver::check_value(model_key("integrator"), message.integrator());
  solver::ModelParameters model;
  for (const auto& [member, get, set] : kFields) {
    model.*member = (message.*get)();
  }
  model.lengths_m.assign(message.lengths_m().begin(), message.lengths_m().end());
  model.elements_per_link = static_cast<int>(message.elements_per_link());
  model.integrator = static_cast<solver::Integrator>(message.integrator());
  return model;
}

solver::ModelParameters from_message(const ModelParameters& message) {
  solver::ModelParameters model = from_message_unchecked(message);
  solver::validate(model);
  return model;
}

std::string canonical_model(const solver::ModelParameters& model) {
  std::vector<std::string> lengths;  // -0.0 + 0.0 is 0.0, so both zeros have the same text
  for (const double length_m : model.lengths_m) {
    lengths.push_back(exact_number(length_m + 0.0));
  }
  std::string text = fmt::format("oblique-model-1 lengths={}", fmt::join(lengths, ","));
  for (const solver::ParameterKey& key : solver::model_keys()) {
    const bool is_usual = key.name == "tolerance" && model.tolerance == Model().tolerance;
    if (key.name != "links" && key.name != "length" && !is_usual) {
      text += fmt::format(" {}={}", key.name,
                          key.name == "integrator"
                              ? std::string(solver::integrator_name(model.integrator))
                              : exact_number(key.get(model) + 0.0));
    }
  }
  return text;
}

bool is_same_block(const Block& a, const Block& b) {
  return comparable_bytes(a) == comparable_bytes(b);
}

std::string recipe_digest(const Recipe& recipe) {
  std::string bytes = canonical_model(from_message_unchecked(recipe.model()));
  bytes += recipe.errors() ? " errors" : "";
  for (const Block& block : recipe.blocks()) {
    const std::string of_block = comparable_bytes(block);
    bytes += fmt::format(" block {} ", of_block.size());
    bytes += of_block;
  }
  return sha256_of(bytes);
}

void check_size(const Recipe& recipe) {
  const std::size_t bytes = recipe.ByteSizeLong();
  if (bytes > kMaxRecipeBytes) {
    throw InputError(fmt::format(
        "the recipe has {} bytes, and at most {} fit into a message to a worker: write long lists "
        "of "
        "values as ranges, or split long columns of a CSV file into several studies; a listed "
        "value takes 8 bytes",
        bytes, kMaxRecipeBytes));
  }
}

bool parse_recipe(std::string_view bytes, Recipe& recipe) {
  return bytes.size() <= kMaxRecipeBytes && is_recipe_within_limits(bytes) &&
         recipe.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

std::string sha256_of(std::string_view bytes) {
  std::array<unsigned char, crypto_hash_sha256_BYTES> digest{};
  crypto_hash_sha256(digest.data(), reinterpret_cast<const unsigned char*>(bytes.data()),
                     bytes.size());
  std::string text(2 * digest.size() + 1, '\0');  // libsodium appends a zero byte
  sodium_bin2hex(text.data(), text.size(), digest.data(), digest.size());
  text.pop_back();
  return text;
}

Axis listed_axis(const solver::ParameterKey& key, const std::vector<double>& values) {
  Axis axis = axis_of(key);
  axis.mutable_values()->Assign(values.begin(), values.end());
  return axis;
}

void throw_wrong_count(const solver::ParameterKey& key, std::string_view written) {
  throw InputError(
      key.name,
      fmt::format(
          "{}: count = {} is not allowed: count must be a whole number without a point, at least 1",
          key.name, written));
}

Axis counted_axis(const solver::ParameterKey& key, double from, double to, std::int64_t count,
                  Spacing spacing) {
  if (count < 1) {
    throw_wrong_count(key, std::to_string(count));
  }
  Axis axis = axis_of(key);
  axis.set_from(from);
  axis.set_to(to);
  axis.set_count(static_cast<std::uint64_t>(count));
  axis.set_spacing(spacing);
  return axis;
}

Axis stepped_axis(const solver::ParameterKey& key, double from, double to, double step) {
  check_ends(key, from, to);
  const double steps = (to - from) / step;
  if (!(std::isfinite(step) && step > 0.0 && steps <= static_cast<double>(kMaxPoints))) {
    throw InputError(
        key.name,
        fmt::format("{}: step = {} is not allowed: step must be > 0 and make at most {} values",
                    key.name, exact_number(step), kMaxPoints));
  }
  const double whole_steps = std::round(steps);
  // Steps in decimals are not exact in binary. This relative tolerance is well above rounding
  // errors.
  const double tolerance = 1e-9 * std::max(1.0, steps);
  if (std::abs(steps - whole_steps) > tolerance) {
    const double below = from + std::floor(steps) * step;
    throw InputError(key.name, fmt::format("{}: step = {} does not lead from {} to {}: the last "
                                           "value before `to` is {} and the next {}; "
                                           "change `to` or the step, or give `count`",
                                           key.name, exact_number(step), exact_number(from),
                                           exact_number(to), solver::readable_number(below, 10),
                                           solver::readable_number(below + step, 10)));
  }
  return counted_axis(key, from, to, static_cast<std::int64_t>(whole_steps) + 1);
}

Axis drawn_axis(const solver::ParameterKey& key, Distribution distribution) {
  Axis axis = axis_of(key);
  *axis.mutable_distribution() = std::move(distribution);
  return axis;
}

Axis expressed_axis(const solver::ParameterKey& key, std::string_view text) {
  Axis axis = axis_of(key);
  axis.set_expression(std::string(text));
  return axis;
}

Sample parse_sample(std::string_view kind, std::int64_t count, std::int64_t seed) {
  for (const auto& [name, value, least] : {std::tuple{"count", count, 1}, {"seed", seed, 0}}) {
    if (value < least) {
      throw InputError(
          "sample",
          fmt::format("sample: {} = {} is not allowed: it must be a whole number, at least {}",
                      name, value, least));
    }
  }
  Sample sample;
  sample.set_kind(static_cast<SampleKind>(number_of_name(kind, kSamples, "sample")));
  sample.set_count(static_cast<std::uint64_t>(count));
  sample.set_seed(static_cast<std::uint64_t>(seed));
  return sample;
}

std::span<const std::string_view> distribution_names() {
  return kDistributions;
}

std::string_view name_of(DistributionKind kind) {
  return kDistributions.at(static_cast<std::size_t>(kind));
}

std::string_view name_of(SampleKind kind) {
  return kSamples.at(static_cast<std::size_t>(kind));
}

DistributionKind distribution_named(std::string_view name) {
  return static_cast<DistributionKind>(number_of_name(name, kDistributions, "distribution"));
}

const solver::ParameterKey& model_key(std::string_view name) {
  if (const auto* key = solver::find_model_key(name)) {
    return *key;
  }
  std::vector<std::string_view> known{ModelInput::kPreset, ModelInput::kLengths};
  for (const auto& key : solver::model_keys()) {
    known.push_back(key.name);
  }
  throw InputError(
      name, fmt::format("{} of a model: the keys are {}", unknown_key(name, known), joined(known)));
}

solver::ModelParameters ModelInput::model() const {
  solver::ModelParameters model = solver::preset(preset);
  if (lengths_m) {
    if (values.contains("links") || values.contains("length")) {
      throw InputError(kLengths, std::string(kLengthsConflict));
    }
    if (lengths_m->empty()) {
      throw InputError(kLengths,
                       "lengths = [] is not allowed: give the lengths in m, one per link");
    }
    solver::ParameterKey key = model_key("length");
    key.name = kLengths;
    for (const double length_m : *lengths_m) {
      solver::check_value(key, length_m);
    }
    model.lengths_m = *lengths_m;
  }
  for (const auto& [name, value] : values) {
    solver::check_value(model_key(name), value);
  }
  // `links` must be applied before `length`; model_keys() has them in this order.
  for (const auto& key : solver::model_keys()) {
    if (const auto value = values.find(key.name); value != values.end()) {
      key.set(model, value->second);
    }
  }
  solver::validate(model);
  return model;
}

std::string study_name_error(const std::string& name) {
  constexpr std::size_t kMaxBytes = 100;
  // Combining marks U+0300 to U+036F and the no-break space: other texts look the same.
  const auto mark = std::ranges::adjacent_find(name, [](char a, char b) {
    return a == '\xcc' || (a == '\xcd' && b < '\xb0') || (a == '\xc2' && b == '\xa0');
  });
  if (!name.empty() && name.size() <= kMaxBytes && name.front() != '-' && is_visible(name) &&
      mark == name.end()) {
    return {};
  }
  return fmt::format(
      "name = \"{}\" is not allowed: the name of a study has 1 to {} bytes of UTF-8, no control "
      "characters, combining marks, no-break spaces, marks of writing direction or zero-width "
      "characters, and does not begin with '-'",
      visible(name.substr(0, kMaxBytes)), kMaxBytes);
}

std::string priority_error(std::int64_t priority) {
  return priority >= -1000 && priority <= 1000
             ? ""
             : fmt::format("priority = {} is not allowed: it must be {}", priority, kPriorities);
}

}  // namespace oblique::protocol
