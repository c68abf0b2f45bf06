#include "proto/recipe/keys.h"

#include <array>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/suggestion.h"

namespace oblique::protocol {
namespace {

constexpr std::string_view kSingleLength = "length";

/// "length1", "length2", ... where it stays.
template <std::size_t link>
struct LengthName {
  static constexpr std::size_t kDigits = link + 1 < 10 ? 1 : 2;
  static constexpr auto text = [] {
    std::array<char, kSingleLength.size() + kDigits> name{};
    kSingleLength.copy(name.data(), kSingleLength.size());
    std::size_t rest = link + 1;
    for (std::size_t i = name.size(); i > kSingleLength.size(); --i, rest /= 10) {
      name[i - 1] = static_cast<char>('0' + rest % 10);
    }
    return name;
  }();
};

template <std::size_t link>
constexpr solver::ParameterKey length_key() {
  const auto& name = LengthName<link>::text;
  return {{name.data(), name.size()},
          "m",
          "length of one link, counted from the pin",
          "> 0",
          [](double value) { return value > 0.0; },
          [](const solver::ModelParameters& m) {
            return link < m.lengths_m.size() ? m.lengths_m[link] : 0.0;
          },
          [](solver::ModelParameters& m, double value) {
            if (link < m.lengths_m.size()) {
              m.lengths_m[link] = value;
            }
          }};
}

template <std::size_t... links>
constexpr std::array<solver::ParameterKey, sizeof...(links)> length_keys(
    std::index_sequence<links...>) {
  return {length_key<links>()...};
}

constexpr auto kLengthKeys = length_keys(std::make_index_sequence<kMostLinks>());

std::vector<std::string_view> all_keys() {
  std::vector<std::string_view> names;
  for (const auto& key : solver::model_keys()) {
    names.push_back(key.name);
  }
  names.insert(names.end(), {kLengthKeys[0].name, kLengthKeys[1].name, kLengthKeys[2].name, "..."});
  names.insert(names.end(), kPointKeyOrder.begin(), kPointKeyOrder.end());
  return names;
}

std::size_t first_point_key() {
  return solver::model_keys().size() + kMostLinks;
}

}  // namespace

std::size_t key_number(std::string_view name) {
  const auto model_keys = solver::model_keys();
  if (const solver::ParameterKey* key = solver::find_model_key(name)) {
    return static_cast<std::size_t>(key - model_keys.data());
  }
  for (std::size_t i = 0; i < kPointKeyOrder.size(); ++i) {
    if (name == kPointKeyOrder[i]) {
      return first_point_key() + i;
    }
  }
  if (name.starts_with(kSingleLength)) {
    for (std::size_t link = 0; link < kMostLinks; ++link) {
      if (name == kLengthKeys[link].name) {
        return model_keys.size() + link;
      }
    }
  }
  if (name == "preset" || name == "lengths") {
    throw solver::InputError(
        fmt::format("{} cannot be an axis of a block: it stands in [model]", name));
  }
  const auto known = all_keys();
  throw solver::InputError(
      fmt::format("{}: the keys are {}", unknown_key(name, known), joined(known)));
}

const solver::ParameterKey& key_numbered(std::size_t number) {
  const auto model_keys = solver::model_keys();
  if (const auto link = link_of_key(number)) {
    return kLengthKeys.at(*link);
  }
  return number < model_keys.size() ? model_keys[number]
                                    : solver::point_keys()[number - first_point_key()];
}

std::size_t key_count() {
  return first_point_key() + kPointKeyOrder.size();
}

bool is_point_key(std::size_t number) {
  return number >= first_point_key();
}

std::optional<std::size_t> link_of_key(std::size_t number) {
  const std::size_t first = solver::model_keys().size();
  return number >= first && number < first_point_key() ? std::optional(number - first)
                                                       : std::nullopt;
}

const solver::ParameterKey& axis_key(std::string_view name) {
  return key_numbered(key_number(name));
}

bool is_axis_key(std::string_view name) {
  try {
    key_number(name);
    return true;
  } catch (const solver::InputError&) {
    return false;
  }
}

}  // namespace oblique::protocol
