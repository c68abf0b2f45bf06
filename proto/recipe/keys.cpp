#include "proto/recipe/keys.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/suggestion.h"

namespace oblique::protocol {
namespace {

template <std::size_t link>
solver::ParameterKey length_key() {
  static const std::string name = fmt::format("length{}", link + 1);
  return {name,
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

/// Every key, by its number.
const std::vector<solver::ParameterKey>& all_keys() {
  static const auto keys = []<std::size_t... links>(std::index_sequence<links...>) {
    const auto model = solver::model_keys();
    std::vector<solver::ParameterKey> all(model.begin(), model.end());
    (all.push_back(length_key<links>()), ...);
    all.insert(all.end(), solver::point_keys().begin(), solver::point_keys().end());
    return all;
  }
  (std::make_index_sequence<kMostLinks>());
  return keys;
}

std::optional<std::size_t> find_key_number(std::string_view name) {
  const auto& keys = all_keys();
  const auto found =
      std::find_if(keys.begin(), keys.end(), [&](const auto& key) { return key.name == name; });
  return found == keys.end() ? std::nullopt
                             : std::optional(static_cast<std::size_t>(found - keys.begin()));
}

}  // namespace

const solver::ParameterKey& key_numbered(std::size_t number) {
  return all_keys().at(number);
}

std::size_t key_count() {
  return all_keys().size();
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
