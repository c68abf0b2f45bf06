#include "client/study/point_flags.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/study/study_file.h"
#include "proto/program/usage.h"
#include "proto/recipe/expression.h"
#include "proto/recipe/model_message.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using protocol::BlockKind;
using solver::InputError;
using solver::ParameterKey;

/// Returns the parts of a text without the spaces before them.
std::vector<std::string_view> parts_of(std::string_view text, char separator) {
  auto parts = protocol::split(text, separator);
  for (auto& part : parts) {
    part.remove_prefix(std::min(part.find_first_not_of(' '), part.size()));
  }
  return parts;
}

/// Parses a number in the text of a flag. It is never -0.
double flag_number(std::string_view part) {
  const auto value = solver::number_of(part);
  if (!value) {
    throw InputError(
        (part.empty() ? "a value is missing"
                      : fmt::format("{:?} is not a number{}", part, solver::why_no_number(part))) +
        "; write one value (0.4), a list (0.4,0.6,0.8), a range from:to:count (0.1:2.0:40), "
        "@FILE.csv:COLUMN, normal(MEAN,SD) in a sample, or an expression (A^2/(4*pi))");
  }
  return *value + 0.0;
}

std::vector<double> flag_numbers(std::string_view text) {
  std::vector<double> values;
  for (const auto part : parts_of(text, ',')) {
    values.push_back(flag_number(part));
  }
  return values;
}

std::optional<std::int64_t> whole_number(std::string_view part) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
  return error == std::errc() && end == part.data() + part.size() ? std::optional(value)
                                                                  : std::nullopt;
}

/// Parses from:to:count, from:to:count:log or from:to:step=STEP; in a sample also from:to.
protocol::Axis range_of_flag(const ParameterKey& key, std::string_view text, BlockKind kind) {
  constexpr std::string_view kStep = "step=";
  const auto parts = parts_of(text, ':');
  if (kind == BlockKind::kSample && parts.size() == 2) {
    protocol::Distribution uniform;
    uniform.set_from(flag_number(parts[0]));
    uniform.set_to(flag_number(parts[1]));
    return protocol::drawn_axis(key, uniform);
  }
  const bool has_spacing = parts.size() == 4;
  const bool has_step = parts.size() == 3 && parts[2].starts_with(kStep);
  if ((parts.size() != 3 && !has_spacing) ||
      (has_spacing && parts[3] != "log" && parts[3] != "linear")) {
    throw InputError(
        "this is not a range: write from:to:count, such as 0.1:2.0:40, from:to:count:log or "
        "from:to:step=0.05; from:to alone is allowed only in a --sample");
  }
  const double from = flag_number(parts[0]);
  const double to = flag_number(parts[1]);
  if (has_step) {
    return protocol::stepped_axis(key, from, to, flag_number(parts[2].substr(kStep.size())));
  }
  const auto count = whole_number(parts[2]);
  if (!count) {
    protocol::throw_wrong_count(key, parts[2]);
  }
  return protocol::counted_axis(
      key, from, to, *count,
      has_spacing && parts[3] == "log" ? protocol::SPACING_LOGARITHMIC : protocol::SPACING_LINEAR);
}

/// Parses @FILE:COLUMN. Without a column, @FILE means the only column of the file, or else the
/// column with the name of the key.
protocol::Axis column_of_flag(const ParameterKey& key, std::string_view text, CsvFiles& files) {
  const auto colon = text.rfind(':');
  const CsvFile& file =
      files.at(std::string(text.substr(1, colon == std::string_view::npos ? colon : colon - 1)));
  std::string column(key.name);
  if (colon != std::string_view::npos) {
    column = text.substr(colon + 1);
  } else if (file.columns().size() == 1) {
    column = file.columns().front();
  }
  return protocol::listed_axis(key, file.values(column, key));
}

/// Parses normal(MEAN,SD), normal(MEAN,SD,FROM,TO) with FROM or TO optional, uniform(FROM,TO) or
/// log-uniform(FROM,TO).
protocol::Distribution distribution_of_flag(std::string_view text) {
  const auto bracket = text.find('(');
  protocol::Distribution written;
  written.set_kind(protocol::distribution_named(text.substr(0, bracket)));
  auto parts = parts_of(text.substr(bracket + 1, text.size() - bracket - 2), ',');
  const bool is_normal = written.kind() == protocol::DISTRIBUTION_NORMAL;
  if (is_normal ? parts.size() < 2 || parts.size() > 4 : parts.size() != 2) {
    throw InputError(is_normal ? "write normal(MEAN,SD), or normal(MEAN,SD,FROM,TO) to truncate it"
                               : fmt::format("write {}(FROM,TO)", name_of(written.kind())));
  }
  if (is_normal) {
    written.set_mean(flag_number(parts[0]));
    written.set_sd(flag_number(parts[1]));
    parts.erase(parts.begin(), parts.begin() + 2);
    parts.resize(2);
  }
  if (!is_normal || !parts[0].empty()) {
    written.set_from(flag_number(parts[0]));
  }
  if (!is_normal || !parts[1].empty()) {
    written.set_to(flag_number(parts[1]));
  }
  return written;
}

/// Whether a text has the form NAME(...), where NAME is a distribution. In a sample, NAME may be
/// anything except the name of a function.
bool is_distribution(std::string_view text, BlockKind kind) {
  const std::string_view name = text.substr(0, std::min(text.find('('), text.size()));
  const auto functions = expressions::functions();
  const auto distributions = protocol::distribution_names();
  const bool is_function = std::ranges::count(functions, name, &expressions::Function::name) > 0;
  const bool is_call = name.size() < text.size() && text.ends_with(')') && !name.empty() &&
                       name.find_first_of("+*/^)<>=!&| ") == std::string_view::npos;
  return is_call && (std::ranges::count(distributions, name) > 0 ||
                     (kind == BlockKind::kSample && !is_function));
}

/// Whether a text contains an operation or another key, and is not a list of numbers.
bool is_expression(std::string_view text) {
  const auto parts = parts_of(text, ',');
  return !std::all_of(parts.begin(), parts.end(),
                      [](std::string_view part) {
                        return part.empty() || solver::number_of(part).has_value() ||
                               !solver::why_no_number(part).empty();
                      }) &&
         (text.find_first_of("+-*/^()<>=!&|?") != std::string_view::npos ||
          protocol::is_axis_key(text));
}

std::vector<double> integrators(std::string_view text) {
  std::vector<double> values;
  for (const auto name : parts_of(text, ',')) {
    values.push_back(static_cast<double>(solver::integrator_named(name)));
  }
  return values;
}

/// Parses kind:count:seed, or kind:count.
protocol::Sample sample_of_flag(std::string_view text) {
  const auto parts = parts_of(text, ':');
  const auto count = parts.size() > 1 ? whole_number(parts[1]) : std::nullopt;
  const auto seed = parts.size() > 2 ? whole_number(parts[2]) : protocol::kUsualSeed;
  if (parts.size() > 3 || !count || !seed) {
    throw InputError("sample",
                     "this is not a sample: write kind:count:seed, such as sobol:100000:1; kinds "
                     "are random, lhs and sobol; count and seed are integers");
  }
  return protocol::parse_sample(parts[0], *count, *seed);
}

std::string described(const ParameterKey& key) {
  std::string text(key.meaning);
  text += key.unit.empty() ? "; " : " [" + std::string(key.unit) + "]; ";
  return text + std::string(key.allowed);
}

BlockKind kind_of_block(const PointFlags& flags) {
  return !flags.sample.empty() ? BlockKind::kSample
         : flags.zip           ? BlockKind::kZip
                               : BlockKind::kProduct;
}

std::vector<double> lengths_of_flag(std::string_view text) {
  std::vector<double> lengths;
  for (const auto part : parts_of(text, ',')) {
    const auto length = solver::number_of(part);
    if (!length) {
      throw InputError(
          "lengths",
          fmt::format(
              "{}; write the length of each link [m], such as 0.4,0.3; --length1, --length2, ... "
              "set one link to several values, such as --length1 0.2:0.4:5 or --length1 mu",
              part.empty() ? "a value is missing" : fmt::format("\"{}\" is not a number", part)));
    }
    lengths.push_back(*length);
  }
  return lengths;
}

std::string default_of(const ParameterKey& key) {
  const solver::ModelParameters defaults;
  if (key.name == "integrator") {
    return std::string(solver::integrator_name(defaults.integrator));
  }
  return solver::exact_number(key.get(defaults));
}

/// Returns a table for the help text, with the accuracy of presets and other meshes.
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
      "Presets, compared with 48 elements a link over 400 random points:\n  preset     elements  "
      "force error  duration error  same mode\n";
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
         "Use standard for predictions. paper has the published mesh and a round section, printed "
         "the\nsection as printed; converged is the reference.";
}

/// Adds the flags that combine axes.
void add_block_flags(CLI::App& command, PointFlags& flags) {
  command
      .add_flag("--zip", flags.zip,
                "combine the axes side by side instead of multiplying them: the first value of "
                "each, the second of each, ...; single values apply to all points")
      ->group("Points");
  command
      .add_option("--sample", flags.sample,
                  "draw points: KIND:COUNT:SEED with the kind random, lhs (Latin hypercube) or "
                  "sobol; axes are then FROM:TO, normal(MEAN,SD), normal(MEAN,SD,FROM,TO), "
                  "uniform(FROM,TO), log-uniform(FROM,TO) or one value")
      ->type_name("SAMPLE")
      ->group("Points");
  command
      .add_option("--where", flags.where,
                  "leave out points that do not meet this condition, such as \"mu > 0.5 * e\"")
      ->type_name("CONDITION")
      ->group("Points");
}

/// Formats help without the flags for single lengths, of which there are 64. The text of
/// `--lengths` names them. If CLI11 hid the flags, error messages would not contain their names.
class BriefHelp : public CLI::Formatter {
 public:
  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override {
    return group == protocol::kUnlisted ? std::string()
                                        : CLI::Formatter::make_group(group, is_positional, options);
  }
};

}  // namespace

void add_point_flags(CLI::App& command, PointFlags& flags, FlagValues values) {
  const auto help = std::make_shared<BriefHelp>();
  help->column_width(command.get_formatter()->get_column_width());
  command.formatter(help);
  const std::string type = values == FlagValues::kOne ? "VALUE" : "VALUES";
  const auto add = [&](const ParameterKey& key, const std::string& group) {
    const std::string name(key.name);
    const bool is_integrator = key.name == "integrator";
    auto* option = command
                       .add_option_function<std::string>(
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
    add_block_flags(command, flags);
  }
  const std::string group = "Model (defaults: the preset `" + flags.preset + "`)";
  auto* preset =
      command
          .add_option("--preset", flags.preset,
                      "preset of the model: " + protocol::joined(solver::preset_names()) +
                          "; single flags override its values")
          ->type_name("NAME")
          ->group(group)
          ->capture_default_str();
  protocol::note_choices(preset, solver::preset_names());
  command
      .add_option("--lengths", flags.lengths,
                  "length of each link, from the pin outwards [m]; > 0; --length1, --length2, ... "
                  "set one link")
      ->type_name("L1,L2,...")
      ->group(group);
  for (const auto& key : solver::model_keys()) {
    add(key, group)->default_str(default_of(key));
  }
  command.footer(fmt::format("{}\n\n{}", command.get_footer(), table_of_presets()));
  for (std::size_t link = 1; link <= protocol::kMaxLinks; ++link) {
    add(protocol::axis_key(fmt::format("length{}", link)), protocol::kUnlisted);
  }
}

std::string flag_of_key(std::string_view key) {
  std::string flag = "--" + std::string(key);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

protocol::Axis axis_of_flag(const ParameterKey& key, std::string_view text, BlockKind kind,
                            CsvFiles& files) {
  return solver::with_key(key.name, [&] {
    if (text.starts_with('@')) {
      return column_of_flag(key, text, files);
    }
    if (key.name == "integrator") {
      return protocol::listed_axis(key, integrators(text));
    }
    if (is_distribution(text, kind)) {
      return protocol::drawn_axis(key, distribution_of_flag(text));
    }
    // Adds advice to the error if the expression contains `a ? b : c`.
    const bool chooses = text.find('?') != std::string_view::npos;
    if (!chooses && text.find(':') != std::string_view::npos) {
      return range_of_flag(key, text, kind);
    }
    return is_expression(text) ? protocol::expressed_axis(key, text)
                               : protocol::listed_axis(key, flag_numbers(text));
  });
}

Places places_of(const PointFlags& flags) {
  std::map<std::string, std::string, std::less<>> places;
  const auto add = [&](const std::string& key, const std::string& text) {
    places[key] = fmt::format("{} {}", flag_of_key(key), protocol::excerpt(text));
  };
  add("preset", flags.preset);
  add("lengths", flags.lengths);
  add("sample", flags.sample);
  add("where", flags.where);
  for (const auto& [key, text] : flags.axes) {
    add(key, text);
  }
  return {"", {std::move(places)}};
}

namespace {

/// Returns the recipe that the flags define; its points are not checked.
protocol::Recipe written_recipe(const PointFlags& flags) {
  protocol::ModelInput model;
  model.preset = flags.preset;
  CsvFiles files(".");
  std::vector<protocol::Axis> axes;
  for (const auto& [name, text] : flags.axes) {
    auto axis = axis_of_flag(protocol::axis_key(name), text, kind_of_block(flags), files);
    if (solver::find_model_key(name) != nullptr && axis.values_size() == 1) {
      model.values[name] = axis.values(0);
    } else {
      axes.push_back(std::move(axis));
    }
  }
  if (!flags.lengths.empty()) {
    model.lengths_m = lengths_of_flag(flags.lengths);
  }
  for (const auto& key : solver::point_keys()) {
    if (!flags.axes.contains(std::string(key.name))) {
      throw InputError(fmt::format("{} is missing: give --H, --mu and --e ({}: {}, {})",
                                   flag_of_key(key.name), key.name, key.meaning, key.allowed));
    }
  }
  protocol::Recipe recipe;
  *recipe.mutable_model() = protocol::to_message(model.model());
  protocol::Block& block = *recipe.add_blocks() = protocol::block_of(std::move(axes));
  block.set_zip(flags.zip);
  block.set_where(flags.where);
  if (!flags.sample.empty()) {
    *block.mutable_sample() = sample_of_flag(flags.sample);
  }
  return recipe;
}

}  // namespace

protocol::Recipe recipe_of_flags(const PointFlags& flags, const ReachCheck& check_reach) {
  const Places places = places_of(flags);
  try {
    protocol::Recipe recipe = written_recipe(flags);
    check_reach(protocol::PointTable(recipe));
    protocol::check_size(recipe);
    return recipe;
  } catch (const InputError& error) {
    throw places.located(error);
  }
}

protocol::PointTable points_of_flags(const PointFlags& flags, const ReachCheck& check_reach) {
  protocol::PointTable table(recipe_of_flags(flags, check_reach));
  check_points(table, places_of(flags));
  return table;
}

std::string name_of_recipe(const protocol::Recipe& recipe) {
  constexpr std::size_t kDigits = 8;
  return fmt::format("sweep-{}", protocol::recipe_digest(recipe).substr(0, kDigits));
}

void add_study_flags(CLI::App& command, StudyFlags& flags) {
  command
      .add_option("STUDY.toml", flags.file,
                  "study file; or define the points with the flags below, whose VALUES are 0.4, "
                  "0.4,0.6, FROM:TO:COUNT, FROM:TO:COUNT:log, FROM:TO:step=STEP, @FILE.csv:COLUMN "
                  "or an expression of other keys, such as \"A^2/(4*pi)\"")
      ->type_name("");
  command
      .add_option(
          "--name", flags.name,
          "name of the study; default: that of the file, or `sweep-` and a hash of the flags")
      ->type_name("NAME");
  command
      .add_flag("--errors", flags.errors,
                "estimate errors: also solve each point on half the mesh and at twice the step, "
                "which costs a quarter more")
      ->group("Points");
  add_point_flags(command, flags.points, FlagValues::kMany);
}

Study study_of_flags(const StudyFlags& flags, const ReachCheck& check_reach) {
  const bool by_flags = flags.points != PointFlags();
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
    study.recipe = recipe_of_flags(flags.points, check_reach);
    study.places = places_of(flags.points);
  } else {
    study = read_study_file(flags.file, check_reach);
  }
  study.recipe.set_errors(study.recipe.errors() || flags.errors);
  if (flags.file.empty()) {
    study.name = name_of_recipe(study.recipe);
  }
  if (!flags.name.empty()) {
    if (const auto objection = protocol::study_name_error(flags.name); !objection.empty()) {
      throw InputError({.text = objection, .key = "name", .place = "--name"});
    }
    study.name = flags.name;
  }
  return study;
}

}  // namespace oblique::client
