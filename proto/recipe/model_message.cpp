#include "proto/recipe/model_message.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <sodium/crypto_hash_sha256.h>
#include <sodium/utils.h>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

/// A number of the model and of its message.
struct Field {
  double solver::ModelParameters::*in_model;
  double (ModelParameters::*get)() const;
  void (ModelParameters::*set)(double);
};

using Model = solver::ModelParameters;
using Message = ModelParameters;

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

constexpr std::string_view kModelHead = "oblique-model-1";

/// Messages have unsigned numbers, and the struct has `int` and an enumeration: checks the range
/// before the conversion.
int checked_whole_number(std::string_view key, std::uint32_t value) {
  solver::check_value(*solver::find_model_key(key), static_cast<double>(value));
  return static_cast<int>(value);
}

/// The text of a number; both zeros have the same.
std::string text_of(double value) {
  return solver::exact_number(value + 0.0);
}

/// Whether a model's text leaves out the key, the value of which is in `lengths` or the default.
bool is_left_out(const solver::ParameterKey& key, const Model& model) {
  return key.name == "links" || key.name == "length" ||
         (key.name == "tolerance" && model.tolerance == Model().tolerance);
}

[[noreturn]] void throw_not_canonical() {
  throw solver::InputError("it is not the canonical text of a model");
}

double read_number(std::string_view text) {
  const auto value = solver::number_of(text);
  if (!value) {
    throw_not_canonical();
  }
  return *value;
}

void read_field(Model& model, std::string_view name, std::string_view value) {
  if (name == "lengths") {
    model.lengths_m.clear();
    for (const auto part : split(value, ',')) {
      model.lengths_m.push_back(read_number(part));
    }
    return;
  }
  const auto* key = solver::find_model_key(name);
  if (key == nullptr || name == "links" || name == "length") {
    throw_not_canonical();
  }
  const double number = name == "integrator" ? static_cast<double>(solver::integrator_named(value))
                                             : read_number(value);
  if (name == "elements_per_link") {
    solver::check_value(*key, number);  // throws if the struct cannot hold the value
  }
  key->set(model, number);
}

/// The bytes for comparison. A range of one or two values becomes a list, and the ends of an axis
/// that is not a range are left out.
std::string comparable_bytes(Block block) {
  for (Axis& axis : *block.mutable_axes()) {
    if (axis.count() == 1 || axis.count() == 2) {
      axis.add_values(axis.from());
      if (axis.count() == 2) {
        axis.add_values(axis.to());
      }
      axis.clear_count();
      axis.clear_spacing();
    }
    if (axis.count() == 0) {
      axis.clear_from();
      axis.clear_to();
    }
  }
  block.DiscardUnknownFields();
  return block.SerializeAsString();
}

}  // namespace

ModelParameters to_message(const solver::ModelParameters& model) {
  ModelParameters message;
  message.mutable_lengths_m()->Assign(model.lengths_m.begin(), model.lengths_m.end());
  message.set_elements_per_link(static_cast<std::uint32_t>(model.elements_per_link));
  message.set_integrator(static_cast<std::uint32_t>(model.integrator));
  for (const Field& field : kFields) {
    (message.*field.set)(model.*field.in_model);
  }
  return message;
}

solver::ModelParameters unjudged_from_message(const ModelParameters& message) {
  solver::ModelParameters model;
  for (const Field& field : kFields) {
    model.*field.in_model = (message.*field.get)();
  }
  model.lengths_m.assign(message.lengths_m().begin(), message.lengths_m().end());
  model.elements_per_link = checked_whole_number("elements_per_link", message.elements_per_link());
  model.integrator =
      static_cast<solver::Integrator>(checked_whole_number("integrator", message.integrator()));
  return model;
}

solver::ModelParameters from_message(const ModelParameters& message) {
  solver::ModelParameters model = unjudged_from_message(message);
  solver::validate(model);
  return model;
}

std::string canonical_model(const solver::ModelParameters& model) {
  std::vector<std::string> lengths;
  for (const double length_m : model.lengths_m) {
    lengths.push_back(text_of(length_m));
  }
  std::string text = fmt::format("{} lengths={}", kModelHead, fmt::join(lengths, ","));
  const auto integrators = solver::integrator_names();
  for (const solver::ParameterKey& key : solver::model_keys()) {
    const double value = key.get(model);
    const bool is_named =
        key.name == "integrator" && value >= 0.0 && value < static_cast<double>(integrators.size());
    if (!is_left_out(key, model)) {
      text += fmt::format(
          " {}={}", key.name,
          is_named ? std::string(integrators[static_cast<std::size_t>(value)]) : text_of(value));
    }
  }
  return text;
}

solver::ModelParameters model_of_canonical(std::string_view text) {
  solver::ModelParameters model;
  for (const auto field : split(text, ' ')) {
    if (const auto equals = field.find('='); equals != std::string_view::npos) {
      read_field(model, field.substr(0, equals), field.substr(equals + 1));
    }
  }
  // A model has one text, so this finds keys that are missing, repeated or in another order.
  if (canonical_model(model) != text) {
    throw_not_canonical();
  }
  return model;
}

bool is_same_block(const Block& a, const Block& b) {
  return comparable_bytes(a) == comparable_bytes(b);
}

std::string recipe_digest(const Recipe& recipe) {
  std::string bytes = canonical_model(unjudged_from_message(recipe.model()));
  bytes += recipe.errors() ? " errors" : "";
  for (const Block& block : recipe.blocks()) {
    const std::string of_block = comparable_bytes(block);
    bytes += fmt::format(" block {} ", of_block.size());
    bytes += of_block;
  }
  return sha256_of(bytes);
}

std::string sha256_of(std::string_view bytes) {
  std::array<unsigned char, crypto_hash_sha256_BYTES> digest{};
  crypto_hash_sha256(digest.data(), reinterpret_cast<const unsigned char*>(bytes.data()),
                     bytes.size());
  std::string text(2 * digest.size() + 1, '\0');  // libsodium ends it with a zero
  sodium_bin2hex(text.data(), text.size(), digest.data(), digest.size());
  text.pop_back();
  return text;
}

}  // namespace oblique::protocol
