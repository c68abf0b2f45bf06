#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/web/answers/answer_pool.h"
#include "server/web/answers/point_set.h"
#include "server/web/answers/study_answers.h"

// What of a study's points a picture shows: those that meet a condition in the query language,
// which a reader process evaluates.
namespace oblique::server {

/// What the reader is asked.
struct FilterQuestion {
  std::string condition;  ///< as people wrote it
  std::string narrowed;   ///< the same, of the points that the picture can show
};

/// Judges the fields of a slice (`is_slice`) or of bins before a reader has to do with them, and
/// says in `question` what it is to be asked. Its answer is that of a step; see AnswerPool::kStep.
AnswerPool::Job filter_job(std::uint64_t study, const Fields& fields, bool is_slice,
                           std::shared_ptr<FilterQuestion> question);

}  // namespace oblique::server
