#include "proto/recipe/keys.h"

#include <array>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/suggestion.h"

namespace oblique::protocol {
namespace {

/// "length1", "length2", ... in 7 or 8 characters, and 0.
constexpr auto kLengthNames = [] {
  std::array<std::array<char, 9>, kMostLinks> names{};
  for (std::size_t link = 0; link < kMostLinks; ++link) {
    const std::size_t number = link + 1;
    const std::size_t digits = number < 10 ? 1 : 2;
    std::string_view("length").copy(names[link].data(), 6);
    names[link][5 + digits] = static_cast<char>('0' + number % 10);
    if (digits == 2) {
      names[link][6] = static_cast<char>('0' + number / 10);
    }
  }
  return names;
}();

template <std::size_t link>
constexpr solver::ParameterKey length_key() {
  return {kLengthNames[link].data(),
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

constexpr auto kLengthKeys = []<std::size_t... links>(std::index_sequence<links...>) {
  return std::array<solver::ParameterKey, kMostLinks>{length_key<links>()...};
}
(std::make_index_sequence<kMostLinks>());

std::optional<std::size_t> find_key_number(std::string_view name) {
  const bool is_length = name.starts_with("length");
  for (std::size_t number = 0; number < key_count(); ++number) {
    if (link_of_key(number) && !is_length) {
      number += kMostLinks - 1;  // none of the single lengths
    } else if (key_numbered(number).name == name) {
      return number;
    }
  }
  return std::nullopt;
}

}  // namespace

const solver::ParameterKey& key_numbered(std::size_t number) {
  const auto model_keys = solver::model_keys();
  if (number < model_keys.size()) {
    return model_keys[number];
  }
  number -= model_keys.size();
  return number < kMostLinks ? kLengthKeys.at(number) : solver::point_keys()[number - kMostLinks];
}

std::size_t key_count() {
  return solver::model_keys().size() + kMostLinks + kPointKeyOrder.size();
}

std::size_t key_number(std::string_view name) {
  if (const auto number = find_key_number(name)) {
    return *number;
  }
  if (name == "preset" || name == "lengths") {
    throw solver::InputError(
        fmt::format("{} cannot be an axis of a block: it stands in [model]", name));
  }
  std::vector<std::string_view> known;
  for (const auto& key : solver::model_keys()) {
    known.push_back(key.name);
  }
  known.insert(known.end(), {"length1", "length2", "length3", "..."});
  known.insert(known.end(), kPointKeyOrder.begin(), kPointKeyOrder.end());
  throw solver::InputError(
      fmt::format("{}: the keys are {}", unknown_key(name, known), joined(known)));
}

const solver::ParameterKey& axis_key(std::string_view name) {
  return key_numbered(key_number(name));
}

bool is_axis_key(std::string_view name) {
  return find_key_number(name).has_value();
}

bool is_point_key(std::size_t number) {
  return number >= solver::model_keys().size() + kMostLinks;
}

std::optional<std::size_t> link_of_key(std::size_t number) {
  const std::size_t first = solver::model_keys().size();
  return number >= first && !is_point_key(number) ? std::optional(number - first) : std::nullopt;
}

}  // namespace oblique::protocol
