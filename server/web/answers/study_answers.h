#pragma once

#include <cstdint>
#include <string>

#include "proto/oblique.pb.h"
#include "server/web/answers/answer_pool.h"
#include "server/web/answers/fields.h"

// Answers about a study; server/web/page/README.md lists their fields.
namespace oblique::server {

/// The recipe of a study and the columns of its results.
AnswerPool::Job study_job(std::uint64_t study);
/// A point: its inputs and its row.
AnswerPool::Job point_job(std::uint64_t study, std::uint64_t point);
/// One column over one or two axes of a grid.
AnswerPool::Job slice_job(std::uint64_t study, const Fields& fields);
/// Number of points, and mean of a column, in bins along one or two columns.
AnswerPool::Job bins_job(std::uint64_t study, const Fields& fields);

/// Parses the body of a submission: SubmitRequest in Protobuf's JSON, with a member `model` that
/// has the keys of study files. Throws std::invalid_argument with a sentence for an invalid body.
protocol::SubmitRequest study_of_body(const std::string& body);

/// Validates the recipe in the body of a submission; the answer has the size of the study.
AnswerPool::Job check_job(const std::string& body);

}  // namespace oblique::server
