#include "proto/recipe/canonical.h"

#include <algorithm>
#include <cstddef>

#include "proto/recipe/model_message.h"
#include "proto/recipe/sha256.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

constexpr std::string_view kModelHead = "oblique-model-1";
/// The keys of version 1 after `lengths`, which are always written. Later keys follow only if they
/// do not have their default, so that earlier texts stay valid.
constexpr std::string_view kFirstKeys =
    "E A I rho g elements_per_link k eta2 tip_mass integrator spectral_radius dt dt_fall";

/// The text of a number; both zeros have the same.
std::string number(double value) {
  return solver::exact_number(value + 0.0);
}

std::string value_of(std::string_view key, double value) {
  const auto names = solver::integrator_names();
  return key == "integrator" && value >= 0.0 && value < static_cast<double>(names.size())
             ? std::string(names[static_cast<std::size_t>(value)])
             : number(value);
}

bool is_later_key(const solver::ParameterKey& key) {
  const auto first = split(kFirstKeys, ' ');
  return key.name != "links" && key.name != "length" &&
         std::find(first.begin(), first.end(), key.name) == first.end();
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

void read_field(solver::ModelParameters& model, std::string_view name, std::string_view value) {
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
  const double set = name == "integrator" ? static_cast<double>(solver::integrator_named(value))
                                          : read_number(value);
  if (name == "elements_per_link") {
    solver::check_value(*key, set);  // throws if the struct cannot hold the value
  }
  key->set(model, set);
}

}  // namespace

std::string canonical_model(const solver::ModelParameters& model) {
  std::string text(kModelHead);
  text += " lengths=";
  for (std::size_t i = 0; i < model.lengths_m.size(); ++i) {
    text += i == 0 ? "" : ",";
    text += number(model.lengths_m[i]);
  }
  const auto add = [&](const solver::ParameterKey& key) {
    text += ' ';
    text += key.name;
    text += '=';
    text += value_of(key.name, key.get(model));
  };
  for (const std::string_view name : split(kFirstKeys, ' ')) {
    add(*solver::find_model_key(name));
  }
  for (const solver::ParameterKey& key : solver::model_keys()) {
    if (is_later_key(key) && key.get(model) != key.get(solver::ModelParameters())) {
      add(key);
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
    bytes += " block " + std::to_string(of_block.size()) + " " + of_block;
  }
  return sha256_of(bytes);
}

}  // namespace oblique::protocol
