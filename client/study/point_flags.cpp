#include "client/study/point_flags.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/study/flag_axis.h"
#include "client/study/study.h"
#include "proto/program/usage.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/written.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::InputError;
using solver::ParameterKey;

std::string described(const ParameterKey& key) {
  std::string text(key.meaning);
  text += key.unit.empty() ? "; " : " [" + std::string(key.unit) + "]; ";
  return text + std::string(key.allowed);
}

/// The flag, as it was typed, whose key a sentence about the points begins with; nothing for
/// others.
std::string flag_named_by(const PointFlags& flags, std::string_view sentence) {
  const std::string key(subject_of(sentence).key);
  if (key == "where") {
    return shown_flag("--where", flags.where) + ": ";
  }
  if (key == "sample") {
    return shown_flag("--sample", flags.sample) + ": ";
  }
  const auto axis = flags.axes.find(key);
  return axis != flags.axes.end() ? shown_flag(flag_of_key(key), axis->second) + ": " : "";
}

protocol::BlockKind kind_of_block(const PointFlags& flags) {
  using enum protocol::BlockKind;
  return !flags.sample.empty() ? kSample : flags.zip ? kZip : kProduct;
}

std::vector<double> lengths_of_flag(std::string_view text) {
  std::vector<double> lengths;
  for (const auto part : protocol::split(text, ',')) {
    const auto length = solver::number_of(part);
    if (!length) {
      throw InputError(fmt::format(
          "{}; write the length of each link [m], as 0.4,0.3; --length1, --length2, ... take more "
          "for one link, as --length1 0.2:0.4:5 or --length1 mu",
          part.empty() ? "a value is missing" : fmt::format("\"{}\" is not a number", part)));
    }
    lengths.push_back(*length);
  }
  return lengths;
}

/// One number, which may as well stand in the model.
bool is_one_value(const protocol::Axis& axis) {
  return protocol::has_own_values(axis) && protocol::axis_size(axis) == 1;
}

std::string default_of(const ParameterKey& key) {
  const solver::ModelParameters defaults;
  if (key.name == "integrator") {
    return std::string(solver::integrator_name(defaults.integrator));
  }
  return solver::exact_number(key.get(defaults));
}

/// What presets and other meshes differ in, for help.
std::string table_of_presets() {
  std::vector<std::pair<std::string_view, solver::ModelParameters>> rows;
  for (const std::string_view name : solver::preset_names()) {
    rows.emplace_back(name, solver::preset(name));
  }
  const auto meshes = solver::mesh_accuracies();
  for (const solver::MeshAccuracy& mesh : meshes) {
    const auto is_on_it = [&](const auto& row) {
      return row.second.elements_per_link == mesh.elements_per_link;
    };
    if (std::none_of(rows.begin(), rows.end(), is_on_it)) {
      rows.emplace_back("-", solver::ModelParameters()).second.elements_per_link =
          mesh.elements_per_link;
    }
  }
  std::string table =
      "Presets, against 48 elements a link over 400 random points:\n"
      "  preset     elements  forces off  duration off  same mode\n";
  for (const auto& [name, model] : rows) {
    const auto mesh = std::find_if(meshes.begin(), meshes.end(),
                                   [elements = model.elements_per_link](const auto& each) {
                                     return each.elements_per_link == elements;
                                   });
    const auto percent = [&](double solver::MeshAccuracy::*value) {
      return mesh == meshes.end() ? "-" : fmt::format("{} %", solver::exact_number((*mesh).*value));
    };
    table += fmt::format("  {:<9}  {:>8}  {:>10}  {:>12}  {:>9}\n", name, model.elements_per_link,
                         percent(&solver::MeshAccuracy::forces_off),
                         percent(&solver::MeshAccuracy::duration_off),
                         percent(&solver::MeshAccuracy::same_mode));
  }
  return table +
         "standard is to predict; paper has the published mesh and a round section, printed the\n"
         "section as printed; converged is the reference.";
}

/// How the axes of the flags are put together.
void add_block_flags(CLI::App& verb, PointFlags& flags) {
  verb.add_flag("--zip", flags.zip,
                "take the axes side by side, the first value of each, the second of each, ..., "
                "instead of multiplying them; single values serve all")
      ->group("Points");
  verb.add_option(
          "--sample", flags.sample,
          "draw points: KIND:COUNT:SEED with the kind random, lhs (Latin hypercube) or sobol; "
          "axes are then FROM:TO, normal(MEAN,SD), normal(MEAN,SD,FROM,TO), "
          "uniform(FROM,TO), log-uniform(FROM,TO) or one value")
      ->type_name("SAMPLE")
      ->group("Points");
  verb.add_option("--where", flags.where,
                  "leave out the points for which this is not true, as \"mu > 0.5 * e\"")
      ->type_name("CONDITION")
      ->group("Points");
}

constexpr std::string_view kSingleLengths = "Single lengths";

/// Help with 64 single lengths would have no end: those of `--lengths` name them. A hidden flag
/// would have no name in messages.
class BriefHelp : public CLI::Formatter {
 public:
  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override {
    return group == kSingleLengths ? std::string()
                                   : CLI::Formatter::make_group(group, is_positional, options);
  }
};

}  // namespace

void add_point_flags(CLI::App& verb, PointFlags& flags, FlagValues values,
                     bool with_single_lengths) {
  const auto help = std::make_shared<BriefHelp>();
  help->column_width(verb.get_formatter()->get_column_width());
  verb.formatter(help);
  const std::string type = values == FlagValues::kOne ? "VALUE" : "VALUES";
  const auto add = [&](const ParameterKey& key, const std::string& group) {
    const std::string name(key.name);
    const bool is_integrator = key.name == "integrator";
    auto* option = verb.add_option_function<std::string>(
                           flag_of_key(key.name),
                           [&flags, name](const std::string& text) { flags.axes[name] = text; },
                           described(key))
                       ->type_name(is_integrator ? "NAME" : type)
                       ->group(group);
    return is_integrator ? protocol::note_choices(option, solver::integrator_names()) : option;
  };
  for (const auto& key : solver::point_keys()) {
    add(key, "Points");
  }
  if (values == FlagValues::kMany) {
    add_block_flags(verb, flags);
  }
  const std::string group = "Model (defaults: the preset `" + flags.preset + "`)";
  auto* preset =
      verb.add_option("--preset", flags.preset,
                      "model to start from: " + protocol::joined(solver::preset_names()) +
                          "; single flags override it")
          ->type_name("NAME")
          ->group(group)
          ->capture_default_str();
  protocol::note_choices(preset, solver::preset_names());
  verb.add_option(
          "--lengths", flags.lengths,
          "length of each link, from the pin outwards [m]; > 0; --length1, --length2, ... set that "
          "of one link")
      ->type_name("L1,L2,...")
      ->group(group);
  for (const auto& key : solver::model_keys()) {
    add(key, group)->default_str(default_of(key));
  }
  verb.footer(fmt::format("{}\n\n{}", verb.get_footer(), table_of_presets()));
  for (std::size_t link = 1; with_single_lengths && link <= protocol::kMostLinks; ++link) {
    add(protocol::axis_key(fmt::format("length{}", link)), std::string(kSingleLengths));
  }
}

protocol::Recipe recipe_of_flags(const PointFlags& flags, const ReachCheck& check_reach) {
  protocol::WrittenModel model;
  at_flag("--preset", flags.preset, [&] { model.set_preset(flags.preset); });
  const auto kind = kind_of_block(flags);
  CsvFiles files(".");
  std::vector<protocol::Axis> axes;
  for (const auto& [name, text] : flags.axes) {
    auto axis = axis_of_flag(protocol::axis_key(name), text, kind, files);
    if (solver::find_model_key(name) != nullptr && is_one_value(axis)) {
      model.set(name, protocol::axis_value(axis, 0));
    } else {
      axes.push_back(std::move(axis));
    }
  }
  if (!flags.lengths.empty()) {
    at_flag("--lengths", flags.lengths, [&] { model.set_lengths(lengths_of_flag(flags.lengths)); });
  }
  protocol::Recipe recipe;
  *recipe.mutable_model() = protocol::to_message(model.model());
  protocol::Block& block = *recipe.add_blocks() = protocol::block_of(std::move(axes));
  block.set_zip(flags.zip);
  block.set_where(flags.where);
  if (!flags.sample.empty()) {
    *block.mutable_sample() = sample_of_flag(flags.sample);
  }
  try {
    check_reach(protocol::PointTable(recipe));
  } catch (const protocol::MissingKey& error) {
    throw InputError(std::string("--") + error.what());  // it begins with the key
  } catch (const InputError& error) {
    throw InputError(with_flag(flags, error.what()));
  }
  protocol::check_size(recipe);
  return recipe;
}

protocol::PointTable points_of_flags(const PointFlags& flags, const ReachCheck& check_reach) {
  protocol::PointTable table(recipe_of_flags(flags, check_reach));
  judge_points(table, [&flags](const std::string& sentence) { return with_flag(flags, sentence); });
  return table;
}

std::string with_flag(const PointFlags& flags, const std::string& sentence) {
  const std::string flag = flag_named_by(flags, sentence);
  const std::string key(subject_of(sentence).key);
  const auto axis = flags.axes.find(key);
  return flag.empty()
             ? sentence
             : flag + without_text(key, axis != flags.axes.end() ? axis->second : flags.where,
                                   sentence);
}

}  // namespace oblique::client
