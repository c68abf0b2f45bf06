#include "client/study/point_flags.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/keys.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/written/written_axis.h"
#include "proto/recipe/written/written_model.h"
#include "proto/suggestion.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::InputError;
using solver::ParameterKey;

/// Runs `work` and puts the flag, as it was typed, before what it throws.
template <typename Work>
auto at_flag(std::string_view flag, std::string_view text, Work work) {
  try {
    return work();
  } catch (const InputError& error) {
    throw InputError(fmt::format("{} {}: {}", flag, text, error.what()));
  }
}

/// The number that a part of a flag's text says.
double flag_number(std::string_view part) {
  const auto value = solver::number_of(part);
  if (!value) {
    throw InputError(
        (part.empty() ? "a value is missing" : fmt::format("\"{}\" is not a number", part)) +
        "; write one value (0.4), a list (0.4,0.6,0.8) or a range from:to:count (0.1:2.0:40)");
  }
  return *value;
}

std::vector<double> flag_numbers(std::string_view text) {
  std::vector<double> values;
  for (const auto part : protocol::split(text, ',')) {
    values.push_back(flag_number(part));
  }
  return values;
}

protocol::Axis range_of_flag(const ParameterKey& key, std::string_view text) {
  const auto parts = protocol::split(text, ':');
  if (parts.size() != 3) {
    throw InputError("this is not a range: write from:to:count, as 0.1:2.0:40");
  }
  const double from = flag_number(parts[0]);
  const double to = flag_number(parts[1]);
  std::int64_t count = 0;
  const auto [end, error] =
      std::from_chars(parts[2].data(), parts[2].data() + parts[2].size(), count);
  if (error != std::errc() || end != parts[2].data() + parts[2].size()) {
    protocol::throw_wrong_count(key, parts[2]);
  }
  return protocol::counted_axis(key, from, to, count);
}

std::vector<double> integrators(std::string_view text) {
  std::vector<double> values;
  for (const auto name : protocol::split(text, ',')) {
    values.push_back(static_cast<double>(solver::integrator_named(name)));
  }
  return values;
}

std::string described(const ParameterKey& key) {
  std::string text(key.meaning);
  text += key.unit.empty() ? "; " : " [" + std::string(key.unit) + "]; ";
  return text + std::string(key.allowed);
}

std::string default_of(const ParameterKey& key) {
  const solver::ModelParameters defaults;
  if (key.name == "integrator") {
    return std::string(solver::integrator_name(defaults.integrator));
  }
  return solver::exact_number(key.get(defaults));
}

}  // namespace

std::string flag_of_key(std::string_view key) {
  std::string flag = "--" + std::string(key);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

void add_point_flags(CLI::App& verb, PointFlags& flags, FlagValues values) {
  const std::string type = values == FlagValues::kOne ? "VALUE" : "VALUES";
  const auto add = [&](const ParameterKey& key, const std::string& group) {
    const std::string name(key.name);
    return verb
        .add_option_function<std::string>(
            flag_of_key(key.name),
            [&flags, name](const std::string& text) { flags.axes[name] = text; }, described(key))
        ->type_name(key.name == "integrator" ? "NAME" : type)
        ->group(group);
  };
  for (const auto& key : solver::point_keys()) {
    add(key, "Points");
  }
  const std::string group = "Model (defaults: the preset `" + flags.preset + "`)";
  verb.add_option("--preset", flags.preset,
                  "model to start from: " + protocol::joined(solver::preset_names()) +
                      "; single flags override it")
      ->type_name("NAME")
      ->group(group)
      ->capture_default_str();
  verb.add_option("--lengths", flags.lengths, "length of each link, from the pin outwards [m]; > 0")
      ->type_name("L1,L2,...")
      ->group(group);
  for (const auto& key : solver::model_keys()) {
    add(key, group)->default_str(default_of(key));
  }
}

protocol::Axis axis_of_flag(const ParameterKey& key, std::string_view text) {
  return at_flag(flag_of_key(key.name), text, [&] {
    if (key.name == "integrator") {
      return protocol::listed_axis(key, integrators(text));
    }
    return text.find(':') != std::string_view::npos
               ? range_of_flag(key, text)
               : protocol::listed_axis(key, flag_numbers(text));
  });
}

protocol::Recipe recipe_of_flags(const PointFlags& flags, const ReachCheck& check_reach) {
  protocol::WrittenModel model;
  at_flag("--preset", flags.preset, [&] { model.set_preset(flags.preset); });
  std::vector<protocol::Axis> axes;
  for (const auto& [name, text] : flags.axes) {
    auto axis = axis_of_flag(protocol::axis_key(name), text);
    if (solver::find_model_key(name) != nullptr && protocol::axis_size(axis) == 1) {
      model.set(name, protocol::axis_value(axis, 0));
    } else {
      axes.push_back(std::move(axis));
    }
  }
  if (!flags.lengths.empty()) {
    at_flag("--lengths", flags.lengths, [&] { model.set_lengths(flag_numbers(flags.lengths)); });
  }
  protocol::Recipe recipe;
  *recipe.mutable_model() = protocol::to_message(model.model());
  *recipe.add_blocks() = protocol::block_of(std::move(axes));
  try {
    check_reach(protocol::PointTable(recipe));
  } catch (const protocol::MissingKey& error) {
    throw InputError(std::string("--") + error.what());  // it begins with the key
  }
  protocol::check_size(recipe);
  return recipe;
}

}  // namespace oblique::client
