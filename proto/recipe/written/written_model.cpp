#include "proto/recipe/written/written_model.h"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/keys.h"
#include "proto/suggestion.h"

namespace oblique::protocol {

const solver::ParameterKey& model_key(std::string_view name) {
  if (const auto* key = solver::find_model_key(name)) {
    return *key;
  }
  std::vector<std::string_view> known{WrittenModel::kPreset, WrittenModel::kLengths};
  for (const auto& key : solver::model_keys()) {
    known.push_back(key.name);
  }
  throw solver::InputError(
      fmt::format("{} of a model: the keys are {}", unknown_key(name, known), joined(known)));
}

void WrittenModel::set_preset(std::string_view name) {
  preset_ = solver::preset(name);
}

void WrittenModel::set_lengths(std::vector<double> lengths_m) {
  lengths_m_ = std::move(lengths_m);
  check_lengths_alone();
  if (lengths_m_->empty()) {
    throw solver::InputError("lengths = [] is not allowed: give the lengths in m, one a link");
  }
  for (const double length_m : *lengths_m_) {
    solver::check_value(model_key("length"), length_m);
  }
}

void WrittenModel::set(std::string_view key, double value) {
  solver::check_value(model_key(key), value);
  values_.insert_or_assign(std::string(key), value);
  check_lengths_alone();
}

void WrittenModel::check_lengths_alone() const {
  if (lengths_m_ && (values_.contains("links") || values_.contains("length"))) {
    throw solver::InputError(std::string(kLengthsStandAlone));
  }
}

solver::ModelParameters WrittenModel::model() const {
  solver::ModelParameters model = preset_;
  if (lengths_m_) {
    model.lengths_m = *lengths_m_;
  }
  // In the order of the listing: `links` must come before `length`.
  for (const auto& key : solver::model_keys()) {
    if (const auto value = values_.find(key.name); value != values_.end()) {
      key.set(model, value->second);
    }
  }
  solver::validate(model);
  return model;
}

}  // namespace oblique::protocol
