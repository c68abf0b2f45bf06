#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "proto/wire/chunk.h"
#include "server/web/answers/fields.h"
#include "server/web/answers/service_client.h"
#include "server/web/http/http_message.h"

// Answers about a study, and answers made by the service. server/web/page/README.md lists their
// fields. Functions throw std::invalid_argument for a wrong request.
namespace oblique::server {

/// A study, as reported by the service.
struct ServedStudy {
  /// Returns whether the filter leaves out a point that has no row. In a done study it does: a
  /// worker has evaluated the filter, perhaps with values that differ from ours in the last digit.
  bool leaves_out(std::uint64_t point) const {
    return table->has_filter() && (state == "done" || !table->passes_filter(point));
  }

  std::uint64_t id = 0;
  std::string name = {};
  std::string state = {};
  std::shared_ptr<const protocol::PointTable> table = {};
};

/// Makes an answer from the rows of one or more queries of a study.
class StudyAnswer {
 public:
  /// `condition` is the user's condition. An error about it quotes it unchanged.
  explicit StudyAnswer(std::string condition = {}) : condition_(std::move(condition)) {}
  virtual ~StudyAnswer() = default;
  StudyAnswer(const StudyAnswer&) = delete;
  StudyAnswer& operator=(const StudyAnswer&) = delete;

  /// Returns the answer, or the next query; the caller sets the study in the query. Called at the
  /// beginning and after the last row of each query.
  using Next = std::variant<protocol::StudyQuery, HttpAnswer>;
  virtual Next next(const ServedStudy& study) = 0;
  virtual void take_row(const protocol::ChunkRows& /*row*/) {}
  const std::string& condition() const { return condition_; }

 private:
  const std::string condition_;
};

using FlowClock = std::chrono::steady_clock;

/// Requests the study and then the queries from the service, one after another. Reader processes
/// run the queries. They are ended when the pending answer is destroyed, or at `deadline`.
PendingAnswer study_flow(ServiceClient& service, std::uint64_t study,
                         std::unique_ptr<StudyAnswer> answer,
                         FlowClock::time_point deadline = FlowClock::now() +
                                                          std::chrono::seconds(7));

/// Returns the recipe of a study and the columns of its results.
PendingAnswer study_answer(ServiceClient& service, std::uint64_t study);
/// Returns the inputs of a point according to the recipe. If the point has no row, also returns
/// whether the filter leaves it out.
PendingAnswer point_answer(ServiceClient& service, std::uint64_t study, std::uint64_t point);
/// Returns the values of one column over one or two axes of a grid.
PendingAnswer slice_answer(ServiceClient& service, std::uint64_t study, const Fields& fields);
/// Returns the number of points, and the mean of a column, in bins along one or two columns.
PendingAnswer bins_answer(ServiceClient& service, std::uint64_t study, const Fields& fields);

/// Parses the body of a submission: a SubmitRequest in Protobuf's JSON format, with a member
/// `model` that has the keys of study files.
protocol::SubmitRequest study_of_body(const std::string& body);

/// Validates the recipe in the body of a submission. The answer contains the size of the study.
HttpAnswer check_answer(const std::string& body);

// ---- Answers that the service makes

PendingAnswer list_studies(ServiceClient& service, const Fields& fields);
PendingAnswer list_workers(ServiceClient& service, const Fields& fields);
PendingAnswer query_rows(ServiceClient& service, std::uint64_t study, const Fields& fields);
PendingAnswer solve_trace(ServiceClient& service, std::uint64_t study, std::uint64_t point,
                          const Fields& fields);
PendingAnswer submit_study(ServiceClient& service, const std::string& body);
PendingAnswer change_study(ServiceClient& service, std::uint64_t study,
                           protocol::StudyChange change);
/// Parses "pause", "resume", "cancel" or "retry".
std::optional<protocol::StudyChange> study_change(std::string_view name);

}  // namespace oblique::server
