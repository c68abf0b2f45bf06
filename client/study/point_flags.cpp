#include "client/study/point_flags.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <utility>
#include <vector>

#include "client/study/nearest.h"
#include "client/study/study_file.h"
#include "proto/recipe/recipe.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::InputError;
using solver::ParameterKey;

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) {
      return parts;
    }
    text.remove_prefix(end + 1);
  }
}

std::string not_a_number(std::string_view flag, std::string_view text, std::string_view part) {
  std::string message = std::string(flag) + " " + std::string(text) + ": ";
  message += part.empty() ? "a value is missing" : "\"" + std::string(part) + "\" is not a number";
  return message +
         "; write one value (0.4), a list (0.4,0.6,0.8) or a range from:to:count (0.1:2.0:40)";
}

double flag_number(std::string_view flag, std::string_view text, std::string_view part) {
  const auto value = parsed_number(part);
  if (!value) {
    throw InputError(not_a_number(flag, text, part));
  }
  return *value;
}

protocol::Axis range_of_flag(const ParameterKey& key, std::string_view text) {
  const auto flag = flag_of_key(key.name);
  const auto parts = split(text, ':');
  if (parts.size() != 3) {
    throw InputError(flag + " " + std::string(text) +
                     " is not a range: write from:to:count, as 0.1:2.0:40");
  }
  const double from = flag_number(flag, text, parts[0]);
  const double to = flag_number(flag, text, parts[1]);
  std::int64_t count = 0;
  const auto [end, error] =
      std::from_chars(parts[2].data(), parts[2].data() + parts[2].size(), count);
  if (error != std::errc() || end != parts[2].data() + parts[2].size()) {
    throw InputError(flag + " " + std::string(text) + ": count = " + std::string(parts[2]) +
                     " is not allowed: count must be a whole number, at least 1");
  }
  return counted_axis(key, from, to, count);
}

protocol::Axis integrator_axis(const ParameterKey& key, std::string_view text) {
  std::vector<double> values;
  for (const auto name : split(text, ',')) {
    values.push_back(static_cast<double>(solver::integrator_named(name)));
  }
  return listed_axis(key, values);
}

void set_lengths(solver::ModelParameters& model, const PointFlags& flags) {
  if (flags.axes.contains("links") || flags.axes.contains("length")) {
    throw InputError("--lengths " + flags.lengths +
                     " stands beside --links or --length: give either --lengths, one a link, or "
                     "--links and --length");
  }
  model.lengths_m.clear();
  for (const auto part : split(flags.lengths, ',')) {
    model.lengths_m.push_back(flag_number("--lengths", flags.lengths, part));
    solver::check_value(*solver::find_model_key("length"), model.lengths_m.back());
  }
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
  verb.add_option(
          "--preset", flags.preset,
          "model to start from: " + joined(solver::preset_names()) + "; single flags override it")
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
  if (key.name == "integrator") {
    return integrator_axis(key, text);
  }
  if (text.find(':') != std::string_view::npos) {
    return range_of_flag(key, text);
  }
  std::vector<double> values;
  for (const auto part : split(text, ',')) {
    values.push_back(flag_number(flag_of_key(key.name), text, part));
  }
  return listed_axis(key, values);
}

protocol::Recipe recipe_of_flags(const PointFlags& flags) {
  auto model = solver::preset(flags.preset);
  if (!flags.lengths.empty()) {
    set_lengths(model, flags);
  }
  std::vector<protocol::Axis> axes;
  for (const auto& key : solver::model_keys()) {
    const auto given = flags.axes.find(std::string(key.name));
    if (given == flags.axes.end()) {
      continue;
    }
    auto axis = axis_of_flag(key, given->second);
    if (protocol::axis_size(axis) == 1) {
      key.set(model, protocol::axis_value(axis, 0));
    } else {
      axes.push_back(std::move(axis));
    }
  }
  solver::validate(model);
  for (const auto& key : solver::point_keys()) {
    const auto given = flags.axes.find(std::string(key.name));
    if (given == flags.axes.end()) {
      throw InputError(flag_of_key(key.name) +
                       " is missing: --H, --mu and --e must all be given (" + described(key) + ")");
    }
    axes.push_back(axis_of_flag(key, given->second));
  }
  protocol::Recipe recipe;
  *recipe.mutable_model() = protocol::to_message(model);
  *recipe.add_blocks() = block_of(std::move(axes));
  ReachChecker()(protocol::PointTable(recipe), 0);
  return recipe;
}

std::string name_of_recipe(const protocol::Recipe& recipe) {
  // FNV-1a: the name must be the same on every machine and in every version.
  std::uint32_t hash = 2166136261U;
  for (const char byte : recipe.SerializeAsString()) {
    hash = (hash ^ static_cast<unsigned char>(byte)) * 16777619U;
  }
  char name[sizeof "sweep-01234567"];
  std::snprintf(name, sizeof name, "sweep-%08x", hash);
  return name;
}

void add_study_flags(CLI::App& verb, StudyFlags& flags) {
  verb.add_option("STUDY.toml", flags.file, "study file; or say the points by the flags below")
      ->type_name("");
  verb.add_option("--name", flags.name,
                  "name of the study; by default the file's, or `sweep-` and a hash of the flags")
      ->type_name("NAME");
  add_point_flags(verb, flags.points, FlagValues::kMany);
}

Study study_of_flags(const StudyFlags& flags) {
  const PointFlags none;
  const bool by_flags = !flags.points.axes.empty() || !flags.points.lengths.empty() ||
                        flags.points.preset != none.preset;
  if (flags.file.empty() && !by_flags) {
    throw InputError("no points: give a study file, or --H, --mu and --e");
  }
  if (!flags.file.empty() && by_flags) {
    throw InputError("both the study file " + flags.file.string() +
                     " and flags for points or model are given: use one of them (the file has a "
                     "[model] of its own)");
  }
  Study study;
  if (flags.file.empty()) {
    study.recipe = recipe_of_flags(flags.points);
    study.name = name_of_recipe(study.recipe);
  } else {
    study = read_study_file(flags.file);
  }
  if (!flags.name.empty()) {
    check_study_name(flags.name);
    study.name = flags.name;
  }
  return study;
}

}  // namespace oblique::client
