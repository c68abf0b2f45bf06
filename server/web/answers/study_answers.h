#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "proto/oblique.pb.h"
#include "server/web/answers/answer_pool.h"
#include "server/web/answers/point_set.h"

// Answers of the page that are made of the database; README.md has their fields.
namespace oblique::server {

using Fields = std::map<std::string, std::string>;

/// What a study is: its recipe, and the columns of its results.
AnswerPool::Job study_job(std::uint64_t study);
/// A point: its inputs, its row if there is one, where that comes from.
AnswerPool::Job point_job(std::uint64_t study, std::uint64_t point);
/// One column over one or two axes of a grid; of results not in `chosen`, unless it is null, the
/// mark `filtered_out`.
AnswerPool::Job slice_job(std::uint64_t study, const Fields& fields,
                          std::shared_ptr<const PointSet> chosen = {});
/// How many points, and the mean of a column, in cells over one or two columns; of `chosen` alone,
/// unless it is null.
AnswerPool::Job bins_job(std::uint64_t study, const Fields& fields,
                         std::shared_ptr<const PointSet> chosen = {});

/// A study as the body of a submission has it: SubmitRequest in Protobuf's JSON, and beside it
/// `model` as people write one. Throws std::invalid_argument with a sentence for what is none.
protocol::SubmitRequest study_of_body(const std::string& body);

/// Whether a recipe, as the body of a submission has it, is one, and what it would come to.
AnswerPool::Job check_job(const std::string& body);

}  // namespace oblique::server
