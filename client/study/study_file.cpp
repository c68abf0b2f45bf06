#include "client/study/study_file.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include <toml++/toml.h>

#include "client/study/nearest.h"
#include "proto/recipe/recipe.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

using solver::InputError;

constexpr std::array<std::string_view, 3> kTopKeys{"name", "model", "block"};
constexpr std::array<std::string_view, 4> kRangeKeys{"from", "to", "count", "step"};
constexpr std::string_view kAxisForms =
    "a number, a list of numbers, { from, to, count } or { from, to, step }";

std::string kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::boolean:
      return "a boolean";
    case toml::node_type::integer:
    case toml::node_type::floating_point:
      return "a number";
    default:
      return "a date or time";
  }
}

// A value of a list or table as the file has it, or nearly; nested ones only by their kind.
std::string element(const toml::node& node) {
  if (const auto* number = node.as_floating_point()) {
    return solver::exact_number(number->get());
  }
  if (node.is_array() || node.is_table()) {
    return kind_of(node);
  }
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

// A value as the file has it, shortened for a message.
std::string shown(const toml::node& node) {
  constexpr std::size_t kMost = 60;
  std::string line;
  if (const auto* list = node.as_array()) {
    for (const auto& value : *list) {
      line += (line.empty() ? "[" : ", ") + element(value);
    }
    line = list->empty() ? "[]" : line + "]";
  } else if (const auto* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      line += (line.empty() ? "{ " : ", ") + std::string(key.str()) + " = " + element(value);
    }
    line = table->empty() ? "{}" : line + " }";
  } else {
    line = element(node);
  }
  line = line.substr(0, line.find('\n'));
  return line.size() > kMost ? line.substr(0, kMost) + "..." : line;
}

bool is_number(const toml::node& node) {
  return node.is_integer() || node.is_floating_point();
}

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
  auto located(const toml::node& at, Work work) const {
    try {
      return work();
    } catch (const InputError& error) {
      fail(at, error.what());
    }
  }

  void check_top_keys(const toml::table& top) const;
  std::string name(const toml::table& top) const;
  solver::ModelParameters model(const toml::node& node) const;
  void set_model_key(solver::ModelParameters& model, std::string_view key,
                     const toml::node& value) const;
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
      fail(node,
           "integrator = " + shown(node) + " is " + kind_of(node) +
               ": it must be the name of one, in quotes: " + joined(solver::integrator_names()));
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
      fail(value, "unknown key `" + std::string(key.str()) + "`" +
                      did_you_mean(key.str(), kTopKeys) +
                      ": a study file has name, [model] and one or more [[block]]; H, mu and e "
                      "stand in a block");
    }
  }
}

std::string Reader::name(const toml::table& top) const {
  const auto* node = top.get("name");
  if (node == nullptr) {
    return std::filesystem::path(file_).stem().string();
  }
  if (!node->is_string()) {
    fail(*node, "name = " + shown(*node) + " is " + kind_of(*node) + ": it must be a string");
  }
  const auto text = *node->value<std::string>();
  located(*node, [&] { check_study_name(text); });
  return text;
}

void Reader::set_model_key(solver::ModelParameters& model, std::string_view key,
                           const toml::node& value) const {
  const auto* found = solver::find_model_key(key);
  if (found == nullptr) {
    std::vector<std::string_view> names{"preset", "lengths"};
    for (const auto& known : solver::model_keys()) {
      names.push_back(known.name);
    }
    fail(value, "unknown key `" + std::string(key) + "` in [model]" + did_you_mean(key, names) +
                    ": the keys are " + joined(names));
  }
  if (value.is_array() || value.is_table()) {
    fail(value, std::string(key) + " = " + shown(value) + " is " + kind_of(value) +
                    ": in [model] it must be one value; a key with several values stands in a "
                    "[[block]]");
  }
  const double chosen =
      key == "integrator" ? axis_number(*found, value) : number(key, value, "a number");
  located(value, [&] {
    solver::check_value(*found, chosen);
    found->set(model, chosen);
  });
}

solver::ModelParameters Reader::model(const toml::node& node) const {
  const auto* table = node.as_table();
  if (table == nullptr) {
    fail(node, "model is " + kind_of(node) + ": write [model], and the keys below it");
  }
  solver::ModelParameters model;
  if (const auto* preset = table->get("preset")) {
    if (!preset->is_string()) {
      fail(*preset, "preset = " + shown(*preset) + " is " + kind_of(*preset) +
                        ": it must be a string: " + joined(solver::preset_names()));
    }
    model = located(*preset, [&] { return solver::preset(*preset->value<std::string>()); });
  }
  if (const auto* lengths = table->get("lengths")) {
    if (table->contains("links") || table->contains("length")) {
      fail(*lengths, "lengths = " + shown(*lengths) +
                         " stands beside links or length: give either lengths, one a link, or "
                         "links and length");
    }
    if (!lengths->is_array() || lengths->as_array()->empty()) {
      fail(*lengths, "lengths = " + shown(*lengths) +
                         " is not allowed: it must be a list of lengths in m, one a link");
    }
    model.lengths_m.clear();
    for (const auto& length : *lengths->as_array()) {
      model.lengths_m.push_back(number("lengths", length, "a list of numbers"));
      located(length, [&] {
        solver::check_value(*solver::find_model_key("length"), model.lengths_m.back());
      });
    }
  }
  // In the order of the listing: `links` must come before `length`.
  for (const auto& key : solver::model_keys()) {
    if (const auto* value = table->get(key.name)) {
      set_model_key(model, key.name, *value);
    }
  }
  for (const auto& [key, value] : *table) {
    if (key.str() != "preset" && key.str() != "lengths" &&
        solver::find_model_key(key.str()) == nullptr) {
      set_model_key(model, key.str(), value);
    }
  }
  located(node, [&] { solver::validate(model); });
  return model;
}

protocol::Axis Reader::range(const solver::ParameterKey& key, const toml::table& range) const {
  const std::string name(key.name);
  for (const auto& [part, value] : range) {
    if (std::find(kRangeKeys.begin(), kRangeKeys.end(), part.str()) == kRangeKeys.end()) {
      fail(value, name + ": unknown key `" + std::string(part.str()) + "`" +
                      did_you_mean(part.str(), kRangeKeys) +
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
    return located(range, [&] { return stepped_axis(key, from, to, apart); });
  }
  const auto& count = *range.get("count");
  if (!count.is_integer()) {
    fail(count, name + ": count = " + shown(count) +
                    " is not allowed: count must be a whole number, at least 1");
  }
  return located(range, [&] { return counted_axis(key, from, to, *count.value<std::int64_t>()); });
}

protocol::Axis Reader::axis(std::string_view name, const toml::node& value) const {
  if (name == "preset" || name == "lengths") {
    fail(value, std::string(name) + " cannot be an axis of a block: it stands in [model]");
  }
  const auto key = located(value, [&] { return axis_key(name); });
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
  return located(value, [&] { return listed_axis(key, values); });
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
  return located(node, [&] { return block_of(std::move(axes)); });
}

Study Reader::study(const toml::table& top) const {
  check_top_keys(top);
  Study study;
  study.name = name(top);
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
    located(node, [&] { check_reach_(protocol::PointTable(alone), 0); });
  }
  try {
    const protocol::PointTable whole(study.recipe);
  } catch (const InputError& error) {
    throw InputError(file_ + ": " + error.what());
  }
  return study;
}

}  // namespace

Study parse_study(std::string_view text, const std::string& file, const ReachCheck& check) {
  try {
    return Reader(file, check).study(toml::parse(text, file));
  } catch (const toml::parse_error& error) {
    throw InputError(file + ":" + std::to_string(error.source().begin.line) + ": " +
                     std::string(error.description()));
  }
}

Study read_study_file(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || std::filesystem::is_directory(path)) {
    throw InputError("cannot read the study file " + path.string() +
                     ": it must be a readable TOML file");
  }
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  return parse_study(text, path.string());
}

}  // namespace oblique::client
