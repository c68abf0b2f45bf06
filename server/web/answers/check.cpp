#include <algorithm>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include <google/protobuf/util/json_util.h>

#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/recipe/study_size.h"
#include "proto/recipe/written/written_model.h"
#include "proto/text.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/http_message.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;

/// A model from JSON: names of a preset and an integrator, and numbers of single keys.
protocol::ModelParameters model_of(const nlohmann::json& written) {
  protocol::WrittenModel model;
  for (const auto& [key, value] : written.items()) {
    if (key == protocol::WrittenModel::kPreset && value.is_string()) {
      model.set_preset(value.get<std::string>());
    } else if (key == "integrator" && value.is_string()) {
      model.set(key, static_cast<double>(solver::integrator_named(value.get<std::string>())));
    } else if (value.is_number()) {
      model.set(key, value.get<double>());
    } else {
      throw solver::InputError("model: " + key + " must be a number; preset and integrator a name");
    }
  }
  return protocol::to_message(model.model());
}

/// The least drop [m] above which only a computed fall shows whether the tip reaches an H of the
/// study; none if the tip reaches all of them.
std::optional<double> surely_reached_m(const protocol::Recipe& recipe) {
  const auto model = protocol::from_message(recipe.model());
  std::optional<double> least_m;
  for (const auto& block : recipe.blocks()) {
    const auto drop_m = protocol::surely_reached_m(model, block);
    if (drop_m && (!least_m || *drop_m < *least_m)) {
      least_m = drop_m;
    }
  }
  return least_m;
}

ordered_json json_of(const std::optional<double>& number) {
  return number ? ordered_json(*number) : ordered_json();
}

}  // namespace

HttpAnswer check_answer(const std::string& body) {
  protocol::SubmitRequest asked = study_of_body(body);
  return parse_request([&] {
    const protocol::PointTable table(std::move(*asked.mutable_recipe()));
    table.judge_points();
    const protocol::StudySize size = protocol::size_of(table);
    return json_answer({{"points", size.points},
                        {"models", size.models},
                        {"falls", size.falls},
                        {"falls_estimated", size.falls_estimated},
                        {"bytes", size.bytes},
                        {"is_counted", !size.points_estimated},
                        {"surely_reached_m", json_of(surely_reached_m(table.recipe()))}});
  });
}

protocol::SubmitRequest study_of_body(const std::string& body) {
  // Protobuf refuses deeper JSON too. Copying or writing a deeper value would overflow the stack.
  constexpr int kDeepest = 50;
  bool is_deep = false;
  auto whole = nlohmann::json::parse(
      body,
      [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
        is_deep = is_deep || depth > kDeepest;
        return !is_deep;
      },
      false);
  const std::string no_study = "the body is no study: ";
  if (is_deep) {
    throw std::invalid_argument(no_study + "it is nested too deeply");
  }
  const bool has_model = whole.is_object() && whole.contains("model");
  const auto written = has_model ? whole["model"] : nlohmann::json();
  if (has_model) {
    whole.erase("model");
  }
  protocol::SubmitRequest asked;
  const auto read =
      google::protobuf::util::JsonStringToMessage(has_model ? whole.dump() : body, &asked);
  if (!read.ok()) {
    throw std::invalid_argument(no_study +
                                protocol::excerpt({read.message().data(), read.message().size()}));
  }
  if (has_model && (!written.is_object() || asked.recipe().has_model())) {
    throw std::invalid_argument(no_study + "its model is said once, as an object");
  }
  if (has_model) {
    *asked.mutable_recipe()->mutable_model() = parse_request([&] { return model_of(written); });
  }
  return asked;
}

}  // namespace oblique::server
