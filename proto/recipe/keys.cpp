#include "proto/recipe/keys.h"

#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/suggestion.h"

namespace oblique::protocol {
namespace {

constexpr std::size_t kLongestQuoted = 64;

std::vector<std::string_view> all_keys() {
  std::vector<std::string_view> names;
  for (const auto& key : solver::model_keys()) {
    names.push_back(key.name);
  }
  names.insert(names.end(), kPointKeyOrder.begin(), kPointKeyOrder.end());
  return names;
}

}  // namespace

std::string unknown_key(std::string_view name, std::span<const std::string_view> known) {
  if (name.size() > kLongestQuoted) {
    return fmt::format("unknown key of {} characters", name.size());
  }
  return fmt::format("unknown key `{}`{}", name, did_you_mean(name, known));
}

std::size_t key_number(std::string_view name) {
  const auto model_keys = solver::model_keys();
  if (const solver::ParameterKey* key = solver::find_model_key(name)) {
    return static_cast<std::size_t>(key - model_keys.data());
  }
  for (std::size_t i = 0; i < kPointKeyOrder.size(); ++i) {
    if (name == kPointKeyOrder[i]) {
      return model_keys.size() + i;
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
  return number < model_keys.size() ? model_keys[number]
                                    : solver::point_keys()[number - model_keys.size()];
}

std::size_t key_count() {
  return solver::model_keys().size() + kPointKeyOrder.size();
}

const solver::ParameterKey& axis_key(std::string_view name) {
  return key_numbered(key_number(name));
}

}  // namespace oblique::protocol
