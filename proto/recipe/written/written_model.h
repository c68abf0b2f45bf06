#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// A model from a study file or flags: a preset, and single keys that override it, set in any
/// order. A wrong value throws InputError when it is set; the message names key, value and what is
/// allowed.
class WrittenModel {
 public:
  /// The keys of a written model in addition to `solver::model_keys()`.
  static constexpr std::string_view kPreset = "preset";
  static constexpr std::string_view kLengths = "lengths";
  /// The message if `lengths` is used together with the keys that it replaces.
  static constexpr std::string_view kLengthsStandAlone =
      "lengths stands beside links or length: give either lengths, one a link, or links and length";

  void set_preset(std::string_view name);
  /// Sets one length [m] per link. Not allowed together with the keys links and length.
  void set_lengths(std::vector<double> lengths_m);
  void set(std::string_view key, double value);

  /// The model. Throws InputError for values that are wrong only in combination.
  solver::ModelParameters model() const;

 private:
  void check_lengths_alone() const;

  solver::ModelParameters preset_;
  std::optional<std::vector<double>> lengths_m_;
  std::map<std::string, double, std::less<>> values_;
};

/// The key of a model called `name`. Throws InputError for an unknown one, with the nearest and
/// the list of all.
const solver::ParameterKey& model_key(std::string_view name);

}  // namespace oblique::protocol
