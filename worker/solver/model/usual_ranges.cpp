#include "worker/solver/model/usual_ranges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "worker/solver/model/number.h"

namespace oblique::solver {
namespace {

/// Of a key; 0 is usual wherever it is allowed.
struct UsualRange {
  std::string_view key;
  double from;
  double to;
  std::string_view below = {};  ///< what such a value is, in words; else the range is named
  std::string_view above = {};
};

constexpr std::array<UsualRange, 11> kUsualRanges{{
    {"length", 1e-3, 100.0},
    {"E", 1e8, 1e12, "softer than rubber", "stiffer than diamond"},
    {"A", 1e-8, 1.0},
    {"I", 1e-17, 0.1},
    {"rho", 100.0, 25'000.0, "lighter than cork", "denser than any metal"},
    {"g", 0.1, 100.0},
    {"k", 1e4, 1e10},
    {"eta2", 0.1, 10.0},
    {"tip_mass", 1e-6, 10.0},
    {"H", 1e-4, 10.0},
    {"mu", 0.0, 5.0},
}};

/// The range that an allowed value is outside of; nullptr: it is usual.
const UsualRange* missed_range(const ParameterKey& key, double value) {
  const bool is_length = key.name.starts_with("length");  // length1, length2, ... too
  const auto range = std::find_if(kUsualRanges.begin(), kUsualRanges.end(), [&](const auto& usual) {
    return usual.key == (is_length ? "length" : key.name);
  });
  const bool is_usual =
      range == kUsualRanges.end() || value == 0.0 || (value >= range->from && value <= range->to);
  return is_usual || !std::isfinite(value) || !key.is_allowed(value) ? nullptr : &*range;
}

/// As people type it: 7e10, 2700.
std::string short_number(double value) {
  std::string text = readable_number(value);
  if (auto exponent = text.find('e') + 1; exponent != 0) {  // after the e
    exponent += text[exponent] == '-' ? 1U : 0U;
    text.erase(exponent, text.find_first_not_of("+0", exponent) - exponent);
  }
  return text;
}

std::string with_unit(const ParameterKey& key, double value) {
  std::string text = short_number(value);
  if (!key.unit.empty()) {
    text += ' ';
    text += key.unit;
  }
  return text;
}

std::string outside(const ParameterKey& key, const UsualRange& range) {
  return "outside the usual " + short_number(range.from) + " to " + with_unit(key, range.to);
}

/// The value times the power of 1000 that brings it into the range; of several the nearest to its
/// middle. Nothing for a key without a unit.
std::optional<double> in_another_unit(const ParameterKey& key, const UsualRange& range,
                                      double value) {
  const auto off_middle = [&](double other) {
    return std::abs(std::log(other / std::sqrt(range.from * range.to)));
  };
  std::optional<double> best;
  for (int power = -12; power <= 12 && !key.unit.empty(); power += 3) {
    // Division by a power of ten rounds once, multiplication by a negative one twice.
    const double other = power < 0 ? value / std::pow(10.0, -power) : value * std::pow(10.0, power);
    if (other >= range.from && other <= range.to &&
        (!best || off_middle(other) < off_middle(*best))) {
      best = other;
    }
  }
  return best;
}

}  // namespace

std::string note_on_value(const ParameterKey& key, double value) {
  const UsualRange* range = missed_range(key, value);
  if (range == nullptr) {
    return {};
  }
  const std::string_view words = value < range->from ? range->below : range->above;
  const auto other = in_another_unit(key, *range, value);
  return std::string(key.name) + " = " + with_unit(key, value) + " is " +
         (words.empty() ? outside(key, *range) : std::string(words)) +
         (other ? "; " + short_number(*other) + "?" : "");
}

std::string with_likely_cause(std::string error, const ModelParameters& model) {
  const auto add = [&error](const ParameterKey& key, double value) {
    if (const UsualRange* range = missed_range(key, value)) {
      error += "; likely cause: " + std::string(key.name) + " = " + with_unit(key, value) + " is " +
               outside(key, *range);
    }
  };
  for (const auto& key : model_keys()) {
    if (key.name == "length") {
      const auto [least, largest] =
          std::minmax_element(model.lengths_m.begin(), model.lengths_m.end());
      add(key, *least);
      if (*largest != *least) {
        add(key, *largest);
      }
    } else {
      add(key, key.get(model));
    }
  }
  return error;
}

}  // namespace oblique::solver
