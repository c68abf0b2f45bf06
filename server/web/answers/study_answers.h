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

// Answers of the service, and answers about a study; server/web/page/README.md lists their fields.
// Functions throw std::invalid_argument for a wrong request.
namespace oblique::server {

/// A study, as reported by the service.
struct ServedStudy {
  /// Whether the filter leaves out a point without a row. In a done study it does, because the
  /// worker decided, whose values may differ from ours in the last digit.
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
  /// `condition` is the user's condition. An error about it shows it unchanged.
  explicit StudyAnswer(std::string condition = {}) : condition_(std::move(condition)) {}
  virtual ~StudyAnswer() = default;
  StudyAnswer(const StudyAnswer&) = delete;
  StudyAnswer& operator=(const StudyAnswer&) = delete;

  /// Returns the next query, whose study the caller sets, or the answer. Called at first, and after
  /// the last row of each query.
  using Next = std::variant<protocol::StudyQuery, HttpAnswer>;
  virtual Next next(const ServedStudy& study) = 0;
  virtual void take_row(const protocol::ChunkRows& /*row*/) {}
  const std::string& condition() const { return condition_; }

 private:
  const std::string condition_;
};

using FlowClock = std::chrono::steady_clock;

/// Requests the study and then the queries from the service, one after another. The queries run in
/// reader processes. They end when the pending answer is destroyed, or at `deadline`.
PendingAnswer study_flow(ServiceClient& service, std::uint64_t study,
                         std::unique_ptr<StudyAnswer> answer,
                         FlowClock::time_point deadline = FlowClock::now() +
                                                          std::chrono::seconds(7));

/// The recipe of a study and the columns of its results.
PendingAnswer study_answer(ServiceClient& service, std::uint64_t study);
/// The inputs of a point according to the recipe, and whether the filter leaves out it if it has no
/// row.
PendingAnswer point_answer(ServiceClient& service, std::uint64_t study, std::uint64_t point);
/// Values of one column over one or two axes of a grid.
PendingAnswer slice_answer(ServiceClient& service, std::uint64_t study, const Fields& fields);
/// Number of points, and mean of a column, in bins along one or two columns.
PendingAnswer bins_answer(ServiceClient& service, std::uint64_t study, const Fields& fields);

/// Parses the body of a submission: SubmitRequest in Protobuf's JSON, with a member `model` that
/// has the keys of study files.
protocol::SubmitRequest study_of_body(const std::string& body);

/// Validates the recipe in the body of a submission. The answer contains the size of the study.
HttpAnswer check_answer(const std::string& body);

// ---- Requests that the service answers

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
