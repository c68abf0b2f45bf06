#pragma once

#include <cstdint>
#include <string>

#include "proto/oblique.pb.h"
#include "server/web/answers/answer_pool.h"
#include "server/web/answers/fields.h"

// Answers about a study; server/web/page/README.md has their fields.
namespace oblique::server {

/// The recipe of a study and the columns of its results.
AnswerPool::Job study_job(std::uint64_t study);
/// A point: its inputs and its row.
AnswerPool::Job point_job(std::uint64_t study, std::uint64_t point);
/// One column over one or two axes of a grid.
AnswerPool::Job slice_job(std::uint64_t study, const Fields& fields);
/// Number of points, and mean of a column, in bins along one or two columns.
AnswerPool::Job bins_job(std::uint64_t study, const Fields& fields);

/// A study as the body of a submission has it: SubmitRequest in Protobuf's JSON, and beside it
/// `model` as people write one. Throws std::invalid_argument with a sentence for what is none.
protocol::SubmitRequest study_of_body(const std::string& body);

/// Whether the body of a submission has a valid recipe, and the size of its study.
AnswerPool::Job check_job(const std::string& body);

}  // namespace oblique::server
