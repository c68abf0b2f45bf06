#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "server/web/answers/answer_pool.h"

// Answers of the page that are made of the database; README.md has their fields.
namespace oblique::server {

using Fields = std::map<std::string, std::string>;

/// What a study is: its recipe, and the columns of its results.
AnswerPool::Job study_job(std::uint64_t study);
/// A point: its inputs, its row if there is one, where that comes from.
AnswerPool::Job point_job(std::uint64_t study, std::uint64_t point);
/// One column over one or two axes of a grid.
AnswerPool::Job slice_job(std::uint64_t study, const Fields& fields);
/// How many points, and the mean of a column, in cells over one or two columns.
AnswerPool::Job bins_job(std::uint64_t study, const Fields& fields);

/// Whether a recipe, as the body of a submission has it, is one, and what it would come to.
AnswerPool::Job check_job(const std::string& body);

}  // namespace oblique::server
