#include "client/study/study_file.h"

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include <spdlog/fmt/fmt.h>

#include "client/study/csv_file.h"
#include "client/study/toml_axis.h"
#include "client/study/toml_block.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/recipe/written.h"
#include "proto/small_file.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

using solver::InputError;

constexpr std::array<std::string_view, 4> kTopKeys{"name", "errors", "model", "block"};

/// Turns the tables of one file into a study; every error carries file, line and column.
class StudyReader {
 public:
  StudyReader(const std::string& file, const ReachCheck& check_reach)
      : place_(file),
        files_(std::filesystem::path(file).parent_path()),
        check_reach_(check_reach) {}

  Study study(const toml::table& top);

 private:
  std::string name(const toml::table& top) const;
  solver::ModelParameters model(const toml::node& node) const;
  void add_model_key(protocol::WrittenModel& model, std::string_view name,
                     const toml::node& value) const;
  void add_lengths(protocol::WrittenModel& model, const toml::node& value) const;
  const toml::array& blocks(const toml::table& top) const;
  void add_block(Study& study, const toml::node& node);
  /// By key, and by none the block itself; each as it stands before a sentence.
  using BlockPlaces = std::map<std::string, std::string, std::less<>>;
  BlockPlaces places_of(const toml::node& node) const;

  protocol::TomlReader place_;
  std::vector<BlockPlaces> places_;
  CsvFiles files_;
  const ReachCheck& check_reach_;
};

std::string StudyReader::name(const toml::table& top) const {
  const auto* node = top.get("name");
  if (node == nullptr) {
    const auto text = std::filesystem::path(place_.file()).stem().string();
    if (const auto objection = protocol::objection_to_study_name(text); !objection.empty()) {
      throw InputError(fmt::format("{}: a study without `name` is called as its file: {}",
                                   place_.file(), objection));
    }
    return text;
  }
  const auto text = place_.text("name", *node, "a string");
  if (const auto objection = protocol::objection_to_study_name(text); !objection.empty()) {
    place_.fail(*node, objection);
  }
  return text;
}

void StudyReader::add_model_key(protocol::WrittenModel& model, std::string_view name,
                                const toml::node& value) const {
  const auto& key = place_.located(
      value, [&]() -> auto& { return protocol::model_key(name); });
  if (value.is_array() || value.is_table()) {
    place_.fail(value,
                fmt::format("{} = {} is {}: in [model] it must be one value; a key with several "
                            "values stands in a [[block]]",
                            name, protocol::shown(value), protocol::kind_of(value)));
  }
  const double chosen = toml_number(place_, key, value,
                                    "a number; one that follows from others stands in a [[block]]");
  place_.located(value, [&] { model.set(name, chosen); });
}

void StudyReader::add_lengths(protocol::WrittenModel& model, const toml::node& value) const {
  if (!value.is_array()) {
    place_.fail(value, fmt::format("lengths = {} is not allowed: it must be a list of lengths in "
                                   "m, one a link",
                                   protocol::shown(value)));
  }
  const auto& key = protocol::model_key("length");
  std::vector<double> lengths_m;
  for (const auto& length : *value.as_array()) {
    lengths_m.push_back(place_.number("lengths", length, "a list of numbers"));
    place_.located(length, [&] { solver::check_value(key, lengths_m.back()); });
  }
  place_.located(value, [&] { model.set_lengths(std::move(lengths_m)); });
}

solver::ModelParameters StudyReader::model(const toml::node& node) const {
  const auto* table = node.as_table();
  if (table == nullptr) {
    place_.fail(node,
                "model is " + protocol::kind_of(node) + ": write [model], and the keys below it");
  }
  protocol::WrittenModel model;
  for (const auto& [key, value] : *table) {
    if (key.str() == protocol::WrittenModel::kPreset) {
      const auto preset = place_.text("preset", value, protocol::joined(solver::preset_names()));
      place_.located(value, [&] { model.set_preset(preset); });
    } else if (key.str() != protocol::WrittenModel::kLengths) {
      const std::string_view name = key.str();
      place_.located(key, [name] { (void)protocol::model_key(name); });
      add_model_key(model, name, value);
    }
  }
  if (const auto* lengths = table->get(protocol::WrittenModel::kLengths)) {
    add_lengths(model, *lengths);
  }
  return place_.located(node, [&] { return model.model(); });
}

const toml::array& StudyReader::blocks(const toml::table& top) const {
  const auto* blocks = top.get("block");
  if (blocks == nullptr) {
    throw InputError(place_.file() +
                     ": no [[block]]: a study needs at least one, with H, mu and e");
  }
  if (!blocks->is_array()) {
    place_.fail(*blocks,
                "block is " + protocol::kind_of(*blocks) + ": write [[block]], in double brackets");
  }
  if (blocks->as_array()->empty()) {
    place_.fail(*blocks, "block = [] is empty: a study needs at least one, with H, mu and e");
  }
  return *blocks->as_array();
}

/// The value of the key that a sentence about a block begins with, else the block.
const toml::node& named_value(const toml::node& block, std::string_view sentence) {
  const auto* table = block.as_table();
  const auto* value =
      table != nullptr ? table->get(sentence.substr(0, sentence.find_first_of(" :"))) : nullptr;
  return value != nullptr ? *value : block;
}

/// Where a block and its values stand, kept for sentences that come later.
StudyReader::BlockPlaces StudyReader::places_of(const toml::node& node) const {
  BlockPlaces places{{"", place_.before(node.source())}};
  if (const auto* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      places.emplace(key.str(), place_.before(value.source()));
    }
  }
  return places;
}

/// Each block is checked alone, so that the error can say where it stands.
void StudyReader::add_block(Study& study, const toml::node& node) {
  places_.push_back(places_of(node));
  *study.recipe.add_blocks() = block_of_toml(place_, node, files_);
  protocol::Recipe alone;
  *alone.mutable_model() = study.recipe.model();
  *alone.add_blocks() = study.recipe.blocks(study.recipe.blocks_size() - 1);
  try {
    check_reach_(protocol::PointTable(alone));
  } catch (const InputError& error) {
    place_.fail(named_value(node, error.what()), error.what());
  }
}

Study StudyReader::study(const toml::table& top) {
  place_.refuse_unknown(top, kTopKeys, "",
                        "a study file has name, errors, [model] and one or more [[block]]; H, mu "
                        "and e stand in a block");
  Study study;
  study.name = name(top);
  const auto* errors = top.get("errors");
  study.recipe.set_errors(errors != nullptr && place_.yes("errors", *errors));
  const auto* base = top.get("model");
  *study.recipe.mutable_model() =
      protocol::to_message(base != nullptr ? model(*base) : solver::ModelParameters());
  for (const auto& node : blocks(top)) {
    add_block(study, node);
  }
  study.located = [places = places_](const std::string& sentence) {
    const Subject subject = subject_of(sentence);
    const BlockPlaces& block = places.at(std::min(subject.block, places.size() - 1));
    const auto found = block.find(subject.key);
    return (found != block.end() ? found : block.find(""))->second + sentence;
  };
  try {
    const protocol::PointTable whole(study.recipe);
    protocol::check_size(study.recipe);
  } catch (const InputError& error) {
    throw InputError(place_.file() + ": " + error.what());
  }
  return study;
}

}  // namespace

Study parse_study(std::string_view text, const std::string& file, const ReachCheck& check_reach) {
  return StudyReader(file, check_reach).study(protocol::TomlReader(file).parse(text));
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
  // A recipe has at most 4 MiB. A number takes 8 bytes in it and up to 25 in a file.
  constexpr std::size_t kMostBytes = std::size_t{16} << 20U;
  return parse_study(protocol::read_small_file(path.string(), "the study file", kMostBytes),
                     path.string(), check_reach);
}

}  // namespace oblique::client
