#include "client/study/study_file.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <utility>

#include <toml++/toml.h>

#include <spdlog/fmt/fmt.h>

#include "client/study/toml_text.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/keys.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/recipe/written/study_name.h"
#include "proto/recipe/written/written_axis.h"
#include "proto/recipe/written/written_model.h"
#include "proto/suggestion.h"

namespace oblique::client {
namespace {

using solver::InputError;

constexpr std::array<std::string_view, 4> kTopKeys{"name", "errors", "model", "block"};
constexpr std::array<std::string_view, 4> kRangeKeys{"from", "to", "count", "step"};
constexpr std::string_view kAxisForms =
    "a number, a list of numbers, { from, to, count } or { from, to, step }";

/// Turns the tables of one file into a study; every error carries file and line.
class Reader {
 public:
  Reader(std::string file, const ReachCheck& check_reach)
      : file_(std::move(file)), check_reach_(check_reach) {}

  Study study(const toml::table& top) const;

 private:
  [[noreturn]] void fail(const toml::node& at, const std::string& message) const {
    throw InputError(file_ + ":" + std::to_string(at.source().begin.line) + ": " + message);
  }

  // Runs `work` and puts file and line before what it throws.
  template <typename Work>
  decltype(auto) located(const toml::node& at, Work work) const {
    try {
      return work();
    } catch (const InputError& error) {
      fail(at, error.what());
    }
  }

  void check_top_keys(const toml::table& top) const;
  std::string name(const toml::table& top) const;
  bool errors(const toml::table& top) const;
  solver::ModelParameters model(const toml::node& node) const;
  void add_model_key(protocol::WrittenModel& model, std::string_view name,
                     const toml::node& value) const;
  void add_preset(protocol::WrittenModel& model, const toml::node& value) const;
  void add_lengths(protocol::WrittenModel& model, const toml::node& value) const;
  protocol::Block block(const toml::node& node) const;
  protocol::Axis axis(std::string_view name, const toml::node& value) const;
  protocol::Axis range(const solver::ParameterKey& key, const toml::table& range) const;
  double number(std::string_view key, const toml::node& node, std::string_view expected) const;
  double axis_number(const solver::ParameterKey& key, const toml::node& node) const;

  std::string file_;
  const ReachCheck& check_reach_;
};

double Reader::number(std::string_view key, const toml::node& node,
                      std::string_view expected) const {
  if (!is_number(node)) {
    fail(node, std::string(key) + " = " + shown(node) + " is " + kind_of(node) + ": it must be " +
                   std::string(expected));
  }
  return *node.value<double>();
}

// A value of an axis; the integrator goes by its name.
double Reader::axis_number(const solver::ParameterKey& key, const toml::node& node) const {
  if (key.name == "integrator") {
    if (!node.is_string()) {
      fail(node, "integrator = " + shown(node) + " is " + kind_of(node) +
                     ": it must be the name of one, in quotes: " +
                     protocol::joined(solver::integrator_names()));
    }
    return located(node, [&] {
      return static_cast<double>(solver::integrator_named(*node.value<std::string>()));
    });
  }
  return number(key.name, node, kAxisForms);
}

void Reader::check_top_keys(const toml::table& top) const {
  for (const auto& [key, value] : top) {
    if (std::find(kTopKeys.begin(), kTopKeys.end(), key.str()) == kTopKeys.end()) {
      fail(value,
           "unknown key `" + std::string(key.str()) + "`" +
               protocol::did_you_mean(key.str(), kTopKeys) +
               ": a study file has name, errors, [model] and one or more [[block]]; H, mu and e "
               "stand in a block");
    }
  }
}

std::string Reader::name(const toml::table& top) const {
  const auto* node = top.get("name");
  if (node == nullptr) {
    const auto text = std::filesystem::path(file_).stem().string();
    if (const auto objection = protocol::objection_to_study_name(text); !objection.empty()) {
      throw InputError(
          fmt::format("{}: a study without `name` is called as its file: {}", file_, objection));
    }
    return text;
  }
  if (!node->is_string()) {
    fail(*node, "name = " + shown(*node) + " is " + kind_of(*node) + ": it must be a string");
  }
  const auto text = *node->value<std::string>();
  if (const auto objection = protocol::objection_to_study_name(text); !objection.empty()) {
    fail(*node, objection);
  }
  return text;
}

bool Reader::errors(const toml::table& top) const {
  const auto* node = top.get("errors");
  if (node == nullptr) {
    return false;
  }
  if (!node->is_boolean()) {
    fail(*node,
         fmt::format("errors = {} is {}: it must be true or false", shown(*node), kind_of(*node)));
  }
  return *node->value<bool>();
}

void Reader::add_model_key(protocol::WrittenModel& model, std::string_view name,
                           const toml::node& value) const {
  const auto& key = located(
      value, [&]() -> auto& { return protocol::model_key(name); });
  if (value.is_array() || value.is_table()) {
    fail(value, fmt::format("{} = {} is {}: in [model] it must be one value; a key with several "
                            "values stands in a [[block]]",
                            name, shown(value), kind_of(value)));
  }
  const double chosen =
      name == "integrator" ? axis_number(key, value) : number(name, value, "a number");
  located(value, [&] { model.set(name, chosen); });
}

void Reader::add_preset(protocol::WrittenModel& model, const toml::node& value) const {
  if (!value.is_string()) {
    fail(value, fmt::format("preset = {} is {}: it must be a string: {}", shown(value),
                            kind_of(value), protocol::joined(solver::preset_names())));
  }
  located(value, [&] { model.set_preset(*value.value<std::string>()); });
}

void Reader::add_lengths(protocol::WrittenModel& model, const toml::node& value) const {
  if (!value.is_array()) {
    fail(value, fmt::format("lengths = {} is not allowed: it must be a list of lengths in m, one a "
                            "link",
                            shown(value)));
  }
  const auto& key = protocol::model_key("length");
  std::vector<double> lengths_m;
  for (const auto& length : *value.as_array()) {
    lengths_m.push_back(number("lengths", length, "a list of numbers"));
    located(length, [&] { solver::check_value(key, lengths_m.back()); });
  }
  located(value, [&] { model.set_lengths(std::move(lengths_m)); });
}

solver::ModelParameters Reader::model(const toml::node& node) const {
  const auto* table = node.as_table();
  if (table == nullptr) {
    fail(node, "model is " + kind_of(node) + ": write [model], and the keys below it");
  }
  protocol::WrittenModel model;
  for (const auto& [key, value] : *table) {
    if (key.str() == protocol::WrittenModel::kPreset) {
      add_preset(model, value);
    } else if (key.str() != protocol::WrittenModel::kLengths) {
      add_model_key(model, key.str(), value);
    }
  }
  if (const auto* lengths = table->get(protocol::WrittenModel::kLengths)) {
    add_lengths(model, *lengths);
  }
  return located(node, [&] { return model.model(); });
}

protocol::Axis Reader::range(const solver::ParameterKey& key, const toml::table& range) const {
  const std::string name(key.name);
  for (const auto& [part, value] : range) {
    if (std::find(kRangeKeys.begin(), kRangeKeys.end(), part.str()) == kRangeKeys.end()) {
      fail(value, name + ": unknown key `" + std::string(part.str()) + "`" +
                      protocol::did_you_mean(part.str(), kRangeKeys) +
                      ": a range is { from, to, count } or { from, to, step }");
    }
  }
  if (!range.contains("from") || !range.contains("to") ||
      range.contains("count") == range.contains("step")) {
    fail(range, name + " = " + shown(range) +
                    " is not a range: give `from`, `to` and either `count` or `step`");
  }
  const double from = number(name + ": from", *range.get("from"), "a number");
  const double to = number(name + ": to", *range.get("to"), "a number");
  if (const auto* step = range.get("step")) {
    const double apart = number(name + ": step", *step, "a number");
    return located(range, [&] { return protocol::stepped_axis(key, from, to, apart); });
  }
  const auto& count = *range.get("count");
  if (!count.is_integer()) {
    located(count, [&] { protocol::throw_wrong_count(key, shown(count)); });
  }
  return located(
      range, [&] { return protocol::counted_axis(key, from, to, *count.value<std::int64_t>()); });
}

protocol::Axis Reader::axis(std::string_view name, const toml::node& value) const {
  const auto& key = located(
      value, [&]() -> auto& { return protocol::axis_key(name); });
  if (const auto* table = value.as_table()) {
    return range(key, *table);
  }
  std::vector<double> values;
  if (const auto* list = value.as_array()) {
    for (const auto& item : *list) {
      values.push_back(axis_number(key, item));
      located(item, [&] { solver::check_value(key, values.back()); });
    }
  } else {
    values.push_back(axis_number(key, value));
  }
  return located(value, [&] { return protocol::listed_axis(key, values); });
}

protocol::Block Reader::block(const toml::node& node) const {
  const auto* table = node.as_table();
  if (table == nullptr) {
    fail(node, "block holds " + kind_of(node) + ": write [[block]], and the axes below it");
  }
  std::vector<protocol::Axis> axes;
  for (const auto& [key, value] : *table) {
    axes.push_back(axis(key.str(), value));
  }
  return protocol::block_of(std::move(axes));
}

Study Reader::study(const toml::table& top) const {
  check_top_keys(top);
  Study study;
  study.name = name(top);
  study.recipe.set_errors(errors(top));
  if (const auto* node = top.get("model")) {
    *study.recipe.mutable_model() = protocol::to_message(model(*node));
  } else {
    *study.recipe.mutable_model() = protocol::to_message(solver::ModelParameters());
  }
  const auto* blocks = top.get("block");
  if (blocks == nullptr) {
    throw InputError(file_ + ": no [[block]]: a study needs at least one, with H, mu and e");
  }
  if (!blocks->is_array()) {
    fail(*blocks, "block is " + kind_of(*blocks) + ": write [[block]], in double brackets");
  }
  if (blocks->as_array()->empty()) {
    fail(*blocks, "block = [] is empty: a study needs at least one, with H, mu and e");
  }
  for (const auto& node : *blocks->as_array()) {
    *study.recipe.add_blocks() = block(node);
    // Each block is checked alone, so that the error can say where it stands.
    protocol::Recipe alone;
    *alone.mutable_model() = study.recipe.model();
    *alone.add_blocks() = study.recipe.blocks(study.recipe.blocks_size() - 1);
    located(node, [&] { check_reach_(protocol::PointTable(alone)); });
  }
  try {
    const protocol::PointTable whole(study.recipe);
    protocol::check_size(study.recipe);
  } catch (const InputError& error) {
    throw InputError(file_ + ": " + error.what());
  }
  return study;
}

}  // namespace

Study parse_study(std::string_view text, const std::string& file, const ReachCheck& check_reach) {
  try {
    return Reader(file, check_reach).study(toml::parse(text, file));
  } catch (const toml::parse_error& error) {
    throw InputError(file + ":" + std::to_string(error.source().begin.line) + ": " +
                     std::string(error.description()));
  }
}

Study read_study_file(const std::filesystem::path& path, const ReachCheck& check_reach) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || std::filesystem::is_directory(path)) {
    throw InputError("cannot read the study file " + path.string() +
                     ": it must be a readable TOML file");
  }
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  return parse_study(text, path.string(), check_reach);
}

}  // namespace oblique::client
