#include <chrono>
#include <stdexcept>
#include <utility>

#include <google/protobuf/util/json_util.h>

#include "proto/oblique.pb.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/json_answer.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using Clock = std::chrono::steady_clock;

/// A filter over many points is counted for so long.
constexpr std::chrono::seconds kLongestSurvey{5};

HttpAnswer check_answer(const AnswerDesk& desk, const std::string& body) {
  protocol::SubmitRequest asked;
  const auto read = google::protobuf::util::JsonStringToMessage(body, &asked);
  if (!read.ok()) {
    throw std::invalid_argument("the body is no study: " + std::string(read.message()));
  }
  try {
    protocol::PointTable table(std::move(*asked.mutable_recipe()));
    const auto until = Clock::now() + kLongestSurvey;
    const bool is_counted = !table.needs_survey() ||
                            table.survey([&] { return Clock::now() < until && !desk.is_over(); });
    return json_answer({{"points", table.points()},
                        {"numbers", table.size()},
                        {"models", table.models()},
                        {"is_counted", is_counted}});
  } catch (const solver::InputError& error) {
    throw std::invalid_argument(error.what());
  }
}

}  // namespace

AnswerPool::Job check_job(const std::string& body) {
  return [body](const AnswerDesk& desk) { return check_answer(desk, body); };
}

}  // namespace oblique::server
