#include "server/web/answers/study_answers.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/keys.h"
#include "proto/recipe/model_message.h"
#include "server/query/columns.h"
#include "server/query/question.h"
#include "server/web/http/http_message.h"
#include "worker/solver/model/parameters.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;
using protocol::Axis;

/// Longer lists of values are not in the answer; slices have the values that they show.
constexpr std::uint64_t kMostListed = 4096;

ordered_json distribution_json(const protocol::Distribution& from) {
  constexpr std::array<std::string_view, 3> kNames{"uniform", "log-uniform", "normal"};
  ordered_json json{{"kind", kNames.at(static_cast<std::size_t>(from.kind()))}};
  if (from.has_from()) {
    json["from"] = from.from();
  }
  if (from.has_to()) {
    json["to"] = from.to();
  }
  if (from.kind() == protocol::DISTRIBUTION_NORMAL) {
    json["mean"] = from.mean();
    json["sd"] = from.sd();
  }
  return json;
}

ordered_json axis_json(const protocol::AxisLayout& layout) {
  const Axis& axis = *layout.axis;
  const auto& key = protocol::key_numbered(layout.key);
  ordered_json json{{"key", axis.key()},
                    {"unit", key.unit},
                    {"meaning", key.meaning},
                    {"values", layout.values},
                    {"stride", layout.stride}};
  if (axis.has_distribution()) {
    json["distribution"] = distribution_json(axis.distribution());
  } else if (!axis.expression().empty()) {
    json["expression"] = axis.expression();
  } else if (axis.count() > 0) {
    json["range"] = {
        {"from", axis.from()},
        {"to", axis.to()},
        {"count", axis.count()},
        {"spacing", axis.spacing() == protocol::SPACING_LOGARITHMIC ? "log" : "linear"}};
  } else if (protocol::axis_size(axis) <= kMostListed) {
    json["list"] = std::vector<double>(axis.values().begin(), axis.values().end());
  }
  return json;
}

ordered_json block_json(const protocol::Block& block, const protocol::BlockPlace& place) {
  constexpr std::array<std::string_view, 3> kKinds{"grid", "zip", "sample"};
  ordered_json axes = ordered_json::array();
  for (const protocol::AxisLayout& layout : protocol::layout_of(block)) {
    axes.push_back(axis_json(layout));
  }
  ordered_json json{{"kind", kKinds.at(static_cast<std::size_t>(protocol::block_kind(block)))},
                    {"first_point", place.first_point},
                    {"points", place.points},
                    {"where", block.where()},
                    {"axes", std::move(axes)}};
  if (block.has_sample()) {
    constexpr std::array<std::string_view, 3> kSamples{"random", "lhs", "sobol"};
    json["sample"] = {{"kind", kSamples.at(static_cast<std::size_t>(block.sample().kind()))},
                      {"count", block.sample().count()},
                      {"seed", block.sample().seed()}};
  }
  return json;
}

ordered_json columns_json() {
  ordered_json columns = ordered_json::array();
  for (const Column& column : all_columns()) {
    const auto picture = find_picture_column(column.name);
    columns.push_back({{"name", column.name},
                       {"unit", column.unit},
                       {"kind", column.kind},
                       {"meaning", column.meaning},
                       {"picture", !picture               ? "none"
                                   : picture->is_category ? "categories"
                                                          : "numbers"}});
  }
  return columns;
}

/// The model of blocks without model axes, key by key.
ordered_json model_json(const protocol::Recipe& recipe) {
  const auto model = protocol::unjudged_from_message(recipe.model());
  const solver::ModelParameters usual;
  ordered_json keys = ordered_json::array();
  for (const solver::ParameterKey& key : solver::model_keys()) {
    const bool is_word = key.name == "integrator";
    ordered_json value = is_word ? ordered_json(solver::integrator_name(model.integrator))
                                 : ordered_json(key.get(model));  // NaN and infinity become null
    keys.push_back({{"key", key.name},
                    {"unit", key.unit},
                    {"meaning", key.meaning},
                    {"value", std::move(value)},
                    {"usual", is_word ? model.integrator == usual.integrator
                                      : key.get(model) == key.get(usual)}});
  }
  keys.push_back({{"key", "lengths"},
                  {"unit", "m"},
                  {"meaning", "of each link, from the pin outwards"},
                  {"value", model.lengths_m},
                  {"usual", model.lengths_m == usual.lengths_m}});
  return keys;
}

/// The first failed point and its error; null if none has failed.
ordered_json first_failure(const JobContext& context, const ServedStudy& study) {
  if (study.failed == 0) {
    return nullptr;
  }
  protocol::StudyQuery query;
  query.set_study(study.name);
  query.add_select("point, error");
  query.set_where("error IS NOT NULL");
  query.set_limit(1);
  ordered_json first;
  context.query(query, [&](const protocol::ChunkRows& row) {
    first = {{"point", row.cell(0).integer}, {"error", row.cell(1).text}};
  });
  return first;
}

HttpAnswer study_answer(const JobContext& context, std::uint64_t id) {
  const ServedStudy study = context.study(id);
  const protocol::Recipe& recipe = study.table->recipe();
  constexpr int kMostBlocks = 1000;
  ordered_json blocks = ordered_json::array();
  for (int i = 0; i < std::min(recipe.blocks_size(), kMostBlocks); ++i) {
    blocks.push_back(block_json(recipe.blocks(i), study.table->block(static_cast<std::size_t>(i))));
  }
  return json_answer({{"id", study.id},
                      {"name", study.name},
                      {"state", study.state},
                      {"points", study.table->size()},
                      {"numbers", study.table->size()},
                      {"models", study.table->models()},
                      {"errors", recipe.errors()},
                      {"first_failure", first_failure(context, study)},
                      {"model", model_json(recipe)},
                      {"blocks", std::move(blocks)},
                      {"blocks_left_out", std::max(recipe.blocks_size() - kMostBlocks, 0)},
                      {"columns", columns_json()},
                      {"usual_columns", usual_columns(recipe)}});
}

/// Parses a text as a list; discarded if it is not JSON or is nested deeper than our lists. A
/// foreign file may have any depth, and copying or writing a deep value would overflow the stack.
ordered_json list_of(const std::string& text) {
  constexpr int kDeepest = 3;
  bool is_too_deep = false;
  const auto is_kept = [&is_too_deep](int depth, auto, const ordered_json&) {
    is_too_deep = is_too_deep || depth > kDeepest;
    return !is_too_deep;
  };
  auto list = ordered_json::parse(text, is_kept, false);
  return is_too_deep ? ordered_json(ordered_json::value_t::discarded) : list;
}

ordered_json value_of(const protocol::Cell& cell) {
  switch (cell.kind) {
    case protocol::CellKind::kInteger:
      return cell.integer;
    case protocol::CellKind::kReal:
      return cell.real;
    case protocol::CellKind::kNull:
      return nullptr;
    case protocol::CellKind::kText:
      break;
  }
  std::string text(cell.text);
  if (text.starts_with('[')) {
    auto list = list_of(text);
    return list.is_discarded() ? ordered_json(std::move(text)) : list;
  }
  return text;
}

HttpAnswer point_answer(const JobContext& context, std::uint64_t id, std::uint64_t number) {
  const ServedStudy study = context.study(id);
  if (number >= study.table->size()) {
    throw JobError(
        error_answer(404, fmt::format("the study \"{}\" has no point {}", study.name, number)));
  }
  const protocol::Point point = study.table->point(number);
  ordered_json answer{{"study", study.id},
                      {"name", study.name},
                      {"point", number},
                      {"block", study.table->block_of_point(number)},
                      {"H", point.H_m},
                      {"mu", point.mu},
                      {"e", point.e_star},
                      {"left_out", study.leaves_out(number)},
                      {"fault", study.table->fault(number)},
                      {"row", nullptr}};
  protocol::StudyQuery query;
  query.set_study(study.name);
  query.set_where(fmt::format("point = {}", number));
  for (const Column& column : all_columns()) {
    query.add_select(column.name);
  }
  context.query(query, [&](const protocol::ChunkRows& row) {
    for (int i = 0; i < query.select_size(); ++i) {
      answer["row"][query.select(i)] = value_of(row.cell(static_cast<std::size_t>(i)));
    }
    // The solved values, because another machine may have rounded a value of the recipe
    // differently.
    for (const char* key : {"H", "mu", "e"}) {
      answer[key] = answer["row"][key];
    }
    answer["left_out"] = false;
  });
  return json_answer(answer);
}

}  // namespace

AnswerPool::Job study_job(std::uint64_t study) {
  return [study](const JobContext& context) { return study_answer(context, study); };
}

AnswerPool::Job point_job(std::uint64_t study, std::uint64_t point) {
  return [study, point](const JobContext& context) { return point_answer(context, study, point); };
}

}  // namespace oblique::server
