#include "client/study/study_file.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <toml++/toml.h>

#include "client/study/csv_file.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/small_file.h"
#include "proto/text.h"
#include "proto/toml_reader.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using protocol::BlockKind;
using solver::InputError;
using solver::ParameterKey;
using Names = std::span<const std::string_view>;

constexpr std::array<std::string_view, 4> kTopKeys{"name", "errors", "model", "block"};
constexpr std::array<std::string_view, 5> kBlockKeys{"zip", "sample", "where", "csv", "columns"};
constexpr std::array<std::string_view, 3> kSampleParts{"kind", "count", "seed"};
constexpr std::array<std::string_view, 5> kRangeParts{"from", "to", "count", "step", "spacing"};
constexpr std::array<std::string_view, 2> kCsvParts{"csv", "column"};
constexpr std::array<std::string_view, 5> kDistributionParts{"distribution", "from", "to", "mean",
                                                             "sd"};
constexpr std::string_view kAxisForms =
    "a number, a list of numbers, { from, to, count }, { from, to, step }, { csv, column }, "
    "{ distribution, ... } or an expression in quotes";

/// Parses a single value. An integrator is given by its name.
double number(const protocol::TomlReader& file, const ParameterKey& key, const toml::node& value,
              std::string_view expected) {
  if (key.name != "integrator") {
    return file.number(key.name, value, expected);
  }
  const std::string name =
      file.text(key.name, value,
                "the name of one, in quotes: " + protocol::joined(solver::integrator_names()));
  return file.located(value, [&] { return static_cast<double>(solver::integrator_named(name)); });
}

/// Returns the numbers of a list, after checking that each is allowed for the key.
std::vector<double> numbers(const protocol::TomlReader& file, const ParameterKey& key,
                            const toml::array& list, std::string_view expected) {
  std::vector<double> values;
  for (const auto& item : list) {
    values.push_back(number(file, key, item, expected));
    file.located(item, [&] { solver::check_value(key, values.back()); });
  }
  return values;
}

class AxisTable {
 public:
  AxisTable(const protocol::TomlReader& file, const ParameterKey& key, const toml::table& table,
            BlockKind kind)
      : file_(file), key_(key), table_(table), kind_(kind) {}

  protocol::Axis axis(CsvFiles& files) const {
    if (has("csv") || has("column")) {
      return column(files);
    }
    if (has("distribution")) {
      return distribution();
    }
    const bool is_uniform =
        kind_ == BlockKind::kSample && !has("count") && !has("step") && !has("spacing");
    return is_uniform ? uniform() : range();
  }

 private:
  bool has(std::string_view part) const { return table_.contains(part); }
  void check_parts(Names known, std::string_view forms) const {
    file_.refuse_unknown(table_, known, fmt::format("{}: ", key_.name), forms);
  }
  std::optional<double> value(std::string_view part) const {
    return has(part) ? std::optional(file_.number(fmt::format("{}: {}", key_.name, part),
                                                  *table_.get(part), "a number"))
                     : std::nullopt;
  }
  std::string text(std::string_view part, std::string_view expected) const {
    return file_.text(fmt::format("{}: {}", key_.name, part), *table_.get(part), expected);
  }

  protocol::Axis column(CsvFiles& files) const {
    check_parts(kCsvParts, "a column of a file is { csv = \"FILE.csv\", column = \"NAME\" }");
    if (!has("csv")) {
      file_.fail(table_, fmt::format("{}: `column` needs `csv`, the name of the file", key_.name));
    }
    const CsvFile& csv = files.at(text("csv", "the name of a file, in quotes"));
    std::string name(key_.name);
    if (has("column")) {
      name = text("column", "the name of a column, in quotes");
    } else if (csv.columns().size() == 1) {
      name = csv.columns().front();
    }
    return protocol::listed_axis(key_, csv.values(name, key_));
  }

  protocol::Axis distribution() const {
    check_parts(kDistributionParts,
                "a distribution is { distribution = \"uniform\", from, to }, the same with "
                "\"log-uniform\", or { distribution = \"normal\", mean, sd } with optional `from` "
                "and `to` to truncate it");
    protocol::Distribution drawn;
    drawn.set_kind(protocol::distribution_named(
        text("distribution", "uniform, log-uniform or normal, in quotes")));
    const bool is_normal = drawn.kind() == protocol::DISTRIBUTION_NORMAL;
    if (is_normal != has("mean") || is_normal != has("sd")) {
      file_.fail(
          table_,
          fmt::format("{}: a normal distribution needs mean and sd (standard deviation) and may "
                      "have from and to, which truncate it; the others need exactly from and to",
                      key_.name));
    }
    drawn.set_mean(value("mean").value_or(0.0));
    drawn.set_sd(value("sd").value_or(0.0));
    return with_ends(drawn);
  }

  protocol::Axis uniform() const {
    check_parts(kRangeParts, "in a sample an axis is { from, to } or { distribution, ... }");
    return with_ends({});
  }

  protocol::Axis with_ends(protocol::Distribution drawn) const {
    if (const auto from = value("from")) {
      drawn.set_from(*from);
    }
    if (const auto to = value("to")) {
      drawn.set_to(*to);
    }
    return protocol::drawn_axis(key_, drawn);
  }

  protocol::Axis range() const {
    check_parts(kRangeParts, "a range is { from, to, count } or { from, to, step }");
    if (!has("from") || !has("to") || has("count") == has("step")) {
      file_.fail(table_, fmt::format("{} = {} is not a range: give `from`, `to` and either `count` "
                                     "or `step`",
                                     key_.name, protocol::shown(table_)));
    }
    const std::string spacing =
        has("spacing") ? text("spacing", "linear or log, in quotes") : "linear";
    if (spacing != "linear" && (spacing != "log" || has("step"))) {
      file_.fail(*table_.get("spacing"), fmt::format("{}: spacing = \"{}\" is not allowed: it must "
                                                     "be linear or log; with `step` only linear",
                                                     key_.name, protocol::excerpt(spacing)));
    }
    const double from = *value("from");
    const double to = *value("to");
    if (has("step")) {
      return protocol::stepped_axis(key_, from, to, *value("step"));
    }
    const auto& count = *table_.get("count");
    const auto whole = count.value<std::int64_t>();  // also of 3.0
    if (!whole || !count.is_number()) {
      protocol::throw_wrong_count(key_, protocol::shown(count));
    }
    return protocol::counted_axis(
        key_, from, to, *whole,
        spacing == "log" ? protocol::SPACING_LOGARITHMIC : protocol::SPACING_LINEAR);
  }

  const protocol::TomlReader& file_;
  const ParameterKey& key_;
  const toml::table& table_;
  BlockKind kind_;
};

class BlockReader {
 public:
  BlockReader(const protocol::TomlReader& file, const toml::table& table, CsvFiles& files)
      : file_(file), table_(table), files_(files) {}

  protocol::Block block() const {
    const auto* zip = table_.get("zip");
    const auto* csv = table_.get("csv");
    const auto* sampled = table_.get("sample");
    const bool is_zip = zip != nullptr ? file_.boolean("zip", *zip) : csv != nullptr;
    if (csv != nullptr && !is_zip) {
      file_.fail(*zip, "zip = false is not allowed with csv: the lines of the file are points");
    }
    const BlockKind kind = sampled != nullptr ? BlockKind::kSample
                           : is_zip           ? BlockKind::kZip
                                              : BlockKind::kProduct;
    std::vector<protocol::Axis> axes;
    for (const auto& [key, value] : table_) {
      if (std::find(kBlockKeys.begin(), kBlockKeys.end(), key.str()) == kBlockKeys.end()) {
        check_key(key);
        axes.push_back(solver::with_key(
            key.str(), [&, name = key.str(), &node = value] { return axis(name, node, kind); }));
      }
    }
    add_columns(axes);
    protocol::Block block = protocol::block_of(std::move(axes));
    block.set_zip(is_zip);
    if (sampled != nullptr) {
      *block.mutable_sample() = sample(*sampled);
    }
    if (const auto* where = table_.get("where")) {
      block.set_where(
          file_.text("where", *where, "a condition in quotes, such as \"mu > 0.5 * e\""));
      if (block.where().empty()) {
        file_.fail(*where, "where = \"\" is empty: write a condition, or leave `where` out");
      }
    }
    return block;
  }

 private:
  /// Throws if `key` is no key of an axis and resembles a key of a block.
  void check_key(const toml::key& key) const {
    if (!protocol::nearest(key.str(), kBlockKeys).empty() && !protocol::is_axis_key(key.str())) {
      file_.fail(key, fmt::format("{}: apart from axes, the keys of a block are {}",
                                  protocol::unknown_key(key.str(), kBlockKeys),
                                  protocol::joined(kBlockKeys)));
    }
  }

  protocol::Axis axis(std::string_view name, const toml::node& value, BlockKind kind) const {
    const auto& key = protocol::axis_key(name);
    if (const auto* table = value.as_table()) {
      return AxisTable(file_, key, *table, kind).axis(files_);
    }
    if (const auto* text = value.as_string(); text != nullptr && key.name != "integrator") {
      if (text->get().empty()) {
        file_.fail(value, fmt::format("{} = \"\" is empty: it must be {}", key.name, kAxisForms));
      }
      return protocol::expressed_axis(key, text->get());
    }
    const auto* list = value.as_array();
    return protocol::listed_axis(key, list != nullptr
                                          ? numbers(file_, key, *list, kAxisForms)
                                          : std::vector{number(file_, key, value, kAxisForms)});
  }

  protocol::Sample sample(const toml::node& node) const {
    constexpr std::string_view kForm = "{ kind = \"sobol\", count = 1000, seed = 1 }";
    const auto& parts = file_.table("sample", node, kForm);
    file_.refuse_unknown(parts, kSampleParts, "sample: ", "a sample is { kind, count, seed }");
    const auto whole = [&](std::string_view part) {
      const auto& value = *parts.get(part);
      if (!value.is_integer()) {
        file_.fail(
            value,
            fmt::format(
                "sample: {} = {} is not allowed: it must be an integer without point and exponent",
                part, protocol::shown(value)));
      }
      return *value.value<std::int64_t>();
    };
    if (!parts.contains("kind") || !parts.contains("count")) {
      file_.fail(node, fmt::format("sample = {} lacks `{}`: write {}", protocol::shown(parts),
                                   parts.contains("kind") ? "count" : "kind", kForm));
    }
    return protocol::parse_sample(
        file_.text("sample: kind", *parts.get("kind"), "random, lhs or sobol, in quotes"),
        whole("count"), parts.contains("seed") ? whole("seed") : protocol::kUsualSeed);
  }

  /// Adds axes from the file `csv`: the columns named by `columns`, or all under their own names.
  void add_columns(std::vector<protocol::Axis>& axes) const {
    const auto* node = table_.get("csv");
    const auto* columns = table_.get("columns");
    if (node == nullptr) {
      if (columns != nullptr) {
        file_.fail(*columns, "columns needs `csv`, the name of the file");
      }
      return;
    }
    const std::string path = file_.text("csv", *node, "the name of a file, in quotes");
    const CsvFile& csv = solver::with_key(
        "csv", [&]() -> auto& { return files_.at(path); });
    if (columns == nullptr) {
      for (const std::string& column : csv.columns()) {
        add_column(axes, csv, column, column, "csv");
      }
      return;
    }
    for (const auto& [key, column] :
         file_.table("columns", *columns, "a table from keys to columns, { H = \"drop\" }")) {
      const std::string name = file_.text(fmt::format("columns: {}", key.str()), column,
                                          "the name of a column, in quotes");
      add_column(axes, csv, key.str(), name, "columns");
    }
  }

  /// Adds an axis from a column of a file. Errors name the key `from`.
  void add_column(std::vector<protocol::Axis>& axes, const CsvFile& csv, std::string_view name,
                  const std::string& column, std::string_view from) const {
    solver::with_key(from, [&] {
      if (table_.contains(name)) {
        throw InputError(
            fmt::format("{} is given twice: in the block and by a column of the file", name));
      }
      if (from == "csv" && !protocol::is_axis_key(name)) {
        throw InputError(
            fmt::format("the column `{}` of the file is not the name of a key: choose columns with "
                        "columns = {{ H = \"drop\", mu = \"friction\" }}",
                        protocol::excerpt(name)));
      }
      const auto& key = protocol::axis_key(name);
      axes.push_back(protocol::listed_axis(key, csv.values(column, key)));
    });
  }

  const protocol::TomlReader& file_;
  const toml::table& table_;
  CsvFiles& files_;
};

/// Returns the study's name: the key `name`, else the name of the file.
std::string name_of(const protocol::TomlReader& file, const toml::table& top) {
  const auto* node = top.get("name");
  const std::string name = node != nullptr ? file.text("name", *node, "a string")
                                           : std::filesystem::path(file.file()).stem().string();
  if (const auto objection = protocol::study_name_error(name); !objection.empty()) {
    throw node != nullptr
        ? InputError("name", objection)
        : InputError({.text = "a study without `name` is called like its file: " + objection,
                      .place = file.file()});
  }
  return name;
}

solver::ModelParameters model_of(const protocol::TomlReader& file, const toml::node& node) {
  const auto* table = node.as_table();
  if (table == nullptr) {
    file.fail(node,
              "model is " + protocol::kind_of(node) + ": write [model], and the keys below it");
  }
  return file.located(node, [&] {
    protocol::ModelInput model;
    for (const auto& [written, value] : *table) {
      const std::string_view name = written.str();
      if (name == protocol::ModelInput::kPreset) {
        model.preset = file.text(name, value, protocol::joined(solver::preset_names()));
      } else if (name == protocol::ModelInput::kLengths) {
        ParameterKey key = protocol::model_key("length");
        key.name = name;
        constexpr std::string_view kForm = "a list of numbers, the lengths in m, one per link";
        if (!value.is_array()) {
          file.fail(value, fmt::format("lengths = {} is not allowed: it must be {}",
                                       protocol::shown(value), kForm));
        }
        model.lengths_m = numbers(file, key, *value.as_array(), kForm);
      } else {
        model.values[std::string(name)] =
            number(file, protocol::model_key(name), value,
                   "a number in [model]; several values and expressions belong in a [[block]]");
      }
    }
    return model.model();
  });
}

const toml::array& blocks_of(const protocol::TomlReader& file, const toml::table& top) {
  const auto* blocks = top.get("block");
  if (blocks == nullptr) {
    throw InputError({.text = "no [[block]]: a study needs at least one, with H, mu and e",
                      .place = file.file()});
  }
  if (!blocks->is_array_of_tables()) {
    file.fail(
        *blocks,
        fmt::format(
            "block = {} is not allowed: write [[block]] in double brackets, with its axes below",
            protocol::shown(*blocks)));
  }
  return *blocks->as_array();
}

}  // namespace

Study parse_study(std::string_view text, const std::string& name, const ReachCheck& check_reach) {
  const protocol::TomlReader file(name);
  const toml::table top = file.parse(text);
  file.refuse_unknown(top, kTopKeys, "",
                      "a study file has name, errors, [model] and one or more [[block]]; H, mu "
                      "and e belong in a block");
  return file.located(top, [&] {
    Study study{.name = name_of(file, top), .recipe = {}, .places = {file.file(), {}}};
    const auto* errors = top.get("errors");
    study.recipe.set_errors(errors != nullptr && file.boolean("errors", *errors));
    const auto* model = top.get("model");
    *study.recipe.mutable_model() =
        protocol::to_message(model != nullptr ? model_of(file, *model) : solver::ModelParameters());
    CsvFiles files(std::filesystem::path(name).parent_path());
    for (const auto& block : blocks_of(file, top)) {
      const toml::table& table = *block.as_table();
      auto& places = study.places.blocks.emplace_back();
      places.emplace("", file.place(table.source()));
      for (const auto& [key, value] : table) {
        places.emplace(key.str(), file.place(value.source()));
      }
      *study.recipe.add_blocks() =
          file.located(table, [&] { return BlockReader(file, table, files).block(); });
    }
    try {
      check_reach(protocol::PointTable(study.recipe));
      protocol::check_size(study.recipe);
    } catch (const InputError& error) {
      throw study.places.located(error);
    }
    return study;
  });
}

Study read_study_file(const std::filesystem::path& path, const ReachCheck& check_reach) {
  std::error_code unknown;
  if (!std::filesystem::exists(path, unknown) && !unknown) {
    auto with_ending = path;
    with_ending += ".toml";
    throw InputError(fmt::format("there is no study file {}{}", path.string(),
                                 std::filesystem::exists(with_ending, unknown)
                                     ? fmt::format(" (did you mean `{}`?)", with_ending.string())
                                     : ""));
  }
  // A number takes 8 bytes in a recipe and up to 27 bytes in a file.
  constexpr std::size_t kMaxBytes = 4 * protocol::kMaxRecipeBytes;
  return parse_study(protocol::read_small_file(path.string(), "the study file", kMaxBytes),
                     path.string(), check_reach);
}

namespace {

using protocol::toml_string;
using solver::exact_number;

std::string value_of(std::string_view key, double value) {
  return key == "integrator"
             ? toml_string(solver::integrator_names()[static_cast<std::size_t>(value)])
             : exact_number(value + 0.0);  // adding 0 removes the sign of -0
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

/// Returns the keys in which a model differs from a preset, as lines of TOML.
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

/// Returns the table [model] with the preset that needs the fewest other keys. The preset is
/// written even if it is the default, because another version may have another default.
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
