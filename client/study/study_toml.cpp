#include "client/study/study_toml.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/toml_reader.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using protocol::toml_string;
using solver::exact_number;

std::string value_of(std::string_view key, double value) {
  return key == "integrator"
             ? toml_string(solver::integrator_names()[static_cast<std::size_t>(value)])
             : exact_number(value + 0.0);  // zero has no sign
}

std::string list_of_values(std::string_view key, const protocol::Axis& axis) {
  std::vector<std::string> items;
  for (std::uint64_t i = 0; i < protocol::axis_size(axis); ++i) {
    items.push_back(value_of(key, protocol::axis_value(axis, i)));
  }
  return items.size() == 1 ? items.front() : fmt::format("[{}]", fmt::join(items, ", "));
}

std::string distribution(const protocol::Distribution& drawn) {
  std::string text = fmt::format("{{ distribution = {}", toml_string(name_of(drawn.kind())));
  if (drawn.kind() == protocol::DISTRIBUTION_NORMAL) {
    text +=
        fmt::format(", mean = {}, sd = {}", exact_number(drawn.mean()), exact_number(drawn.sd()));
  }
  if (drawn.has_from()) {
    text += ", from = " + exact_number(drawn.from());
  }
  if (drawn.has_to()) {
    text += ", to = " + exact_number(drawn.to());
  }
  return text + " }";
}

std::string axis_text(const protocol::Axis& axis) {
  if (!axis.expression().empty()) {
    return toml_string(axis.expression());
  }
  if (axis.has_distribution()) {
    return distribution(axis.distribution());
  }
  if (axis.count() == 0 || axis.key() == "integrator") {
    return list_of_values(axis.key(), axis);
  }
  return fmt::format("{{ from = {}, to = {}, count = {}{} }}", exact_number(axis.from()),
                     exact_number(axis.to()), axis.count(),
                     axis.spacing() == protocol::SPACING_LOGARITHMIC ? ", spacing = \"log\"" : "");
}

std::string block_text(const protocol::Block& block) {
  std::string text = "\n[[block]]\n";
  if (block.zip()) {
    text += "zip = true\n";
  }
  if (block.has_sample()) {
    text += fmt::format("sample = {{ kind = {}, count = {}, seed = {} }}\n",
                        toml_string(name_of(block.sample().kind())), block.sample().count(),
                        block.sample().seed());
  }
  for (const auto& axis : block.axes()) {
    text += fmt::format("{} = {}\n", axis.key(), axis_text(axis));
  }
  if (!block.where().empty()) {
    text += fmt::format("where = {}\n", toml_string(block.where()));
  }
  return text;
}

bool is_length(std::string_view key) {
  return key == "links" || key == "length";
}

/// The keys in which a model differs from a preset, as lines of TOML.
std::vector<std::string> overrides(const solver::ModelParameters& model,
                                   const solver::ModelParameters& preset) {
  std::vector<std::string> lines;
  const auto& lengths_m = model.lengths_m;
  const bool are_alike = std::adjacent_find(lengths_m.begin(), lengths_m.end(),
                                            std::not_equal_to<>()) == lengths_m.end();
  if (lengths_m != preset.lengths_m && !are_alike) {
    std::vector<std::string> items;
    std::transform(lengths_m.begin(), lengths_m.end(), std::back_inserter(items), exact_number);
    lines.push_back(fmt::format("lengths = [{}]", fmt::join(items, ", ")));
  }
  for (const auto& key : solver::model_keys()) {
    const bool differs = is_length(key.name) ? are_alike && lengths_m != preset.lengths_m
                                             : key.get(model) != key.get(preset);
    if (differs) {
      lines.push_back(fmt::format("{} = {}", key.name, value_of(key.name, key.get(model))));
    }
  }
  return lines;
}

/// [model] with the preset that leaves the fewest keys to say. Also where that is the default,
/// which another version may not have.
std::string model_text(const solver::ModelParameters& model) {
  std::string_view best;
  std::vector<std::string> fewest;
  for (const std::string_view name : solver::preset_names()) {
    auto lines = overrides(model, solver::preset(name));
    if (best.empty() || lines.size() < fewest.size()) {
      best = name;
      fewest = std::move(lines);
    }
  }
  std::string text = fmt::format("\n[model]\npreset = {}\n", toml_string(best));
  for (const auto& line : fewest) {
    text += line + "\n";
  }
  return text;
}

}  // namespace

std::string study_toml(const std::string& name, const protocol::Recipe& recipe) {
  std::string text = fmt::format("name = {}\n", toml_string(name));
  if (recipe.errors()) {
    text += "errors = true\n";
  }
  text += model_text(protocol::from_message(recipe.model()));
  for (const auto& block : recipe.blocks()) {
    text += block_text(block);
  }
  return text;
}

}  // namespace oblique::client
