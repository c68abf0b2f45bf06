#include "server/web/answers/study_answers.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <google/protobuf/util/json_util.h>
#include <spdlog/fmt/fmt.h>

#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/text.h"
#include "server/query/columns.h"
#include "server/web/http/http_message.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;
using protocol::ClientReply;
using protocol::ClientRequest;

/// Maximum length of a list of values; a longer list is omitted.
constexpr std::uint64_t kMaxListed = 4096;

ordered_json axis_json(const protocol::AxisLayout& layout) {
  const protocol::Axis& axis = *layout.axis;
  ordered_json json{{"key", axis.key()},
                    {"unit", protocol::key_numbered(layout.key).unit},
                    {"values", layout.values},
                    {"stride", layout.stride}};
  if (axis.has_distribution()) {
    constexpr std::array<std::string_view, 3> kKinds{"uniform", "log-uniform", "normal"};
    json["distribution"] = kKinds.at(static_cast<std::size_t>(axis.distribution().kind()));
  } else if (!axis.expression().empty()) {
    json["expression"] = axis.expression();
  } else if (axis.count() > 0) {
    json["range"] = {
        {"from", axis.from()},
        {"to", axis.to()},
        {"count", axis.count()},
        {"spacing", axis.spacing() == protocol::SPACING_LOGARITHMIC ? "log" : "linear"}};
  } else if (protocol::axis_size(axis) <= kMaxListed) {
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
  return {{"kind", kKinds.at(static_cast<std::size_t>(protocol::block_kind(block)))},
          {"first_point", place.first_point},
          {"points", place.points},
          {"where", block.where()},
          {"axes", std::move(axes)}};
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

/// Returns the recipe's model, without the axes of its blocks, as a JSON list of keys.
ordered_json model_json(const protocol::Recipe& recipe) {
  const auto model = protocol::from_message_unchecked(recipe.model());
  ordered_json keys = ordered_json::array();
  for (const solver::ParameterKey& key : solver::model_keys()) {
    keys.push_back({{"key", key.name},
                    {"unit", key.unit},
                    {"value", key.name == "integrator"
                                  ? ordered_json(solver::integrator_name(model.integrator))
                                  : ordered_json(key.get(model))}});  // NaN becomes null
  }
  keys.push_back({{"key", "lengths"}, {"unit", "m"}, {"value", model.lengths_m}});
  return keys;
}

class WholeStudy : public StudyAnswer {
 public:
  Next next(const ServedStudy& study) override {
    const protocol::PointTable& table = *study.table;
    const protocol::Recipe& recipe = table.recipe();
    constexpr int kMaxBlocks = 1000;
    ordered_json blocks = ordered_json::array();
    for (int i = 0; i < std::min(recipe.blocks_size(), kMaxBlocks); ++i) {
      blocks.push_back(block_json(recipe.blocks(i), table.block(static_cast<std::size_t>(i))));
    }
    return json_answer({{"id", study.id},
                        {"name", study.name},
                        {"state", study.state},
                        {"points", table.size()},
                        {"errors", recipe.errors()},
                        {"model", model_json(recipe)},
                        {"blocks", std::move(blocks)},
                        {"blocks_left_out", std::max(recipe.blocks_size() - kMaxBlocks, 0)},
                        {"columns", columns_json()},
                        {"usual_columns", usual_columns(recipe)}});
  }
};

class OnePoint : public StudyAnswer {
 public:
  explicit OnePoint(std::uint64_t point) : point_(point) {}

  Next next(const ServedStudy& study) override {
    if (point_ >= study.table->size()) {
      return error_answer(404, fmt::format("the study \"{}\" has no point {}", study.name, point_));
    }
    const protocol::Point point = study.table->point(point_);
    return json_answer({{"study", study.id},
                        {"name", study.name},
                        {"point", point_},
                        {"block", study.table->block_of_point(point_)},
                        {"H", point.H_m},
                        {"mu", point.mu},
                        {"e", point.e_star},
                        {"left_out", study.leaves_out(point_)},
                        {"fault", study.table->fault(point_)}});
  }

 private:
  const std::uint64_t point_;
};

/// Reads a model from JSON. Preset and integrator are names, all other keys are numbers.
protocol::ModelParameters model_of(const nlohmann::json& written) {
  protocol::ModelInput model;
  for (const auto& [key, value] : written.items()) {
    if (key == protocol::ModelInput::kPreset && value.is_string()) {
      model.preset = value.get<std::string>();
    } else if (key == "integrator" && value.is_string()) {
      model.values[key] = static_cast<double>(solver::integrator_named(value.get<std::string>()));
    } else if (value.is_number()) {
      model.values[key] = value.get<double>();
    } else {
      throw solver::InputError("model: " + key +
                               " must be a number (preset and integrator: a name)");
    }
  }
  return protocol::to_message(model.model());
}

/// Returns the largest drop [m] that every tip of the study surely reaches; nothing if no H of the
/// study exceeds this drop. For a larger H a computed fall is needed.
std::optional<double> surely_reached_m(const protocol::Recipe& recipe) {
  const auto model = protocol::from_message(recipe.model());
  std::optional<double> least_m;
  for (const auto& block : recipe.blocks()) {
    const auto lengths_m = protocol::shortest_model(model, block).lengths_m;
    const double drop_m =
        protocol::kSurelyReached * std::accumulate(lengths_m.begin(), lengths_m.end(), 0.0);
    const protocol::Axis& H = *protocol::point_axes(block)[0];
    if (!H.expression().empty() || protocol::largest_value(H) > drop_m) {
      least_m = std::min(least_m.value_or(drop_m), drop_m);
    }
  }
  return least_m;
}

ordered_json json_of(const std::optional<double>& number) {
  return number ? ordered_json(*number) : ordered_json();
}

class Flow {
 public:
  Flow(ServiceClient& service, std::uint64_t study, std::unique_ptr<StudyAnswer> answer,
       FlowClock::time_point deadline)
      : service_(service), exchange_(service), answer_(std::move(answer)), deadline_(deadline) {
    study_.id = study;
    ClientRequest request;
    request.mutable_status()->set_study_id(study);
    exchange_.send(request);
  }

  std::optional<HttpAnswer> poll() {
    if (waits_for_slot_) {
      if (auto answer = find_recipe()) {
        return answer;
      }
    }
    while (auto reply = exchange_.reply()) {
      if (auto answer = reply->has_error() ? on_error(reply->error()) : on_reply(*reply)) {
        return answer;
      }
    }
    if (FlowClock::now() >= deadline_) {
      return error_answer(503, "the request takes too long: narrow it, for example by a condition");
    }
    return std::nullopt;
  }

 private:
  std::optional<HttpAnswer> on_reply(ClientReply& reply) {
    if (reply.has_status()) {
      return on_status(reply.status());
    }
    if (reply.has_describe()) {
      study_.table = std::make_shared<const protocol::PointTable>(
          std::move(*reply.mutable_describe()->mutable_recipe()));
      service_.recipes().put(study_.id, study_.table);
      slot_.reset();
      return go_on();
    }
    if (error_) {  // the condition alone gives no error, so `error_` has another cause
      return error_;
    }
    if (!protocol::is_sound(reply.query())) {
      throw std::runtime_error("a reader process of the server sent an invalid answer");
    }
    for (protocol::ChunkRows rows(reply.query()); rows.next();) {
      answer_->take_row(rows);
    }
    if (reply.query().ends()) {
      return go_on();
    }
    exchange_.request_more_rows();
    return std::nullopt;
  }

  std::optional<HttpAnswer> on_status(const protocol::StatusReply& status) {
    const protocol::StudyStatus& found = status.studies(0);
    study_.name = found.name();
    study_.state = found.state();
    points_ = found.points();
    return find_recipe();
  }

  std::optional<HttpAnswer> find_recipe() {
    study_.table = service_.recipes().find(study_.id, points_);
    if (study_.table) {
      waits_for_slot_ = false;
      return go_on();
    }
    slot_ = service_.recipe_slots().take();
    waits_for_slot_ = slot_ == nullptr;
    if (slot_) {
      ClientRequest request;
      request.mutable_describe()->set_study(study_.name);
      exchange_.send(request);
    }
    return std::nullopt;
  }

  std::optional<HttpAnswer> on_error(const protocol::ErrorReply& error) {
    HttpAnswer answer = failure(error);
    if (answer.status == MHD_HTTP_NOT_FOUND || error_ || answer_->condition().empty() ||
        error.code() != protocol::ERROR_CODE_WRONG_REQUEST || !study_.table) {
      return answer;
    }
    error_ = std::move(answer);
    protocol::StudyQuery as_written;
    as_written.add_select("point");
    as_written.set_where(answer_->condition());
    as_written.set_limit(1);
    send(std::move(as_written));
    return std::nullopt;
  }

  std::optional<HttpAnswer> go_on() {
    auto next = answer_->next(study_);
    if (auto* const answer = std::get_if<HttpAnswer>(&next)) {
      return std::move(*answer);
    }
    send(std::get<protocol::StudyQuery>(std::move(next)));
    return std::nullopt;
  }

  void send(protocol::StudyQuery query) {
    query.set_study(study_.name);
    ClientRequest request;
    *request.mutable_query()->mutable_question() = std::move(query);
    exchange_.send(request);
  }

  ServiceClient& service_;
  ServiceExchange exchange_;
  ServedStudy study_;
  std::uint64_t points_ = 0;          // number of points in the study
  std::shared_ptr<const void> slot_;  // slot that allows requesting the recipe
  bool waits_for_slot_ = false;
  std::unique_ptr<StudyAnswer> answer_;
  const FlowClock::time_point deadline_;
  std::optional<HttpAnswer> error_;  // set while the user's condition runs alone
};

}  // namespace

PendingAnswer study_flow(ServiceClient& service, std::uint64_t study,
                         std::unique_ptr<StudyAnswer> answer, FlowClock::time_point deadline) {
  return [flow = std::make_shared<Flow>(service, study, std::move(answer), deadline)] {
    return flow->poll();
  };
}

PendingAnswer study_answer(ServiceClient& service, std::uint64_t study) {
  return study_flow(service, study, std::make_unique<WholeStudy>());
}

PendingAnswer point_answer(ServiceClient& service, std::uint64_t study, std::uint64_t point) {
  return study_flow(service, study, std::make_unique<OnePoint>(point));
}

HttpAnswer check_answer(const std::string& body) {
  protocol::SubmitRequest asked = study_of_body(body);
  return parse_request([&] {
    const protocol::PointTable table(std::move(*asked.mutable_recipe()));
    table.validate_points();
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
  // Maximum nesting of JSON. Copying or writing deeper JSON could overflow the stack.
  constexpr int kDeepest = 50;
  bool is_deep = false;
  auto whole = nlohmann::json::parse(
      body,
      [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
        is_deep = is_deep || depth > kDeepest;
        return !is_deep;
      },
      false);
  const std::string no_study = "the body is not a study: ";
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
    throw std::invalid_argument(no_study + "give its model once, as an object");
  }
  if (has_model) {
    *asked.mutable_recipe()->mutable_model() = parse_request([&] { return model_of(written); });
  }
  return asked;
}

}  // namespace oblique::server
