#pragma once

#include <cstdint>
#include <string>

#include "proto/oblique.pb.h"
#include "server/web/answers/fields.h"
#include "server/web/answers/study_flow.h"

// Answers about a study; server/web/page/README.md lists their fields. Functions throw
// std::invalid_argument for a wrong request.
namespace oblique::server {

/// The recipe of a study and the columns of its results.
PendingAnswer study_answer(ServiceClient& service, std::uint64_t study);
/// The inputs of a point as the recipe gives them, and whether the filter leaves it out if it has
/// no row.
PendingAnswer point_answer(ServiceClient& service, std::uint64_t study, std::uint64_t point);
/// One column over one or two axes of a grid.
PendingAnswer slice_answer(ServiceClient& service, std::uint64_t study, const Fields& fields);
/// Number of points, and mean of a column, in bins along one or two columns.
PendingAnswer bins_answer(ServiceClient& service, std::uint64_t study, const Fields& fields);

/// Parses the body of a submission: SubmitRequest in Protobuf's JSON, with a member `model` that
/// has the keys of study files.
protocol::SubmitRequest study_of_body(const std::string& body);

/// Validates the recipe in the body of a submission; the answer has the size of the study.
HttpAnswer check_answer(const std::string& body);

}  // namespace oblique::server
