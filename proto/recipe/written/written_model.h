#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "worker/solver/model/parameters.h"

namespace oblique::protocol {

/// A model as people write it: a preset, and single keys that override it, said in any order. What
/// is wrong with one of them is thrown when it is said, as InputError naming key, value and what is
/// allowed.
class WrittenModel {
 public:
  /// The keys that stand in a model beside those of `solver::model_keys()`.
  static constexpr std::string_view kPreset = "preset";
  static constexpr std::string_view kLengths = "lengths";
  /// What is said to those who write `lengths` and what it stands for too.
  static constexpr std::string_view kLengthsStandAlone =
      "lengths stands beside links or length: give either lengths, one a link, or links and length";

  void set_preset(std::string_view name);
  /// One length in m a link. Not beside the keys links and length.
  void set_lengths(std::vector<double> lengths_m);
  void set(std::string_view key, double value);

  /// All of it. Throws InputError for what is wrong only together.
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
