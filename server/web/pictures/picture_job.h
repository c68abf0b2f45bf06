#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/web/answers/answer_pool.h"
#include "server/web/answers/study_answers.h"
#include "server/web/pictures/child.h"

namespace oblique::server {

/// By what pictures are drawn.
struct PictureSettings {
  std::string program;   ///< `oblique`; empty: that beside the program that runs
  std::string database;  ///< file
  ChildLimits limits = {};
};

/// The picture that `oblique plot` draws of a study, or of the time histories of one of its points,
/// as the fields say. The answer is 400 for what is wrong usage of that program, 422 for what it
/// failed at, both with its sentence; 503 where it is not there, or takes too much.
AnswerPool::Job picture_job(const PictureSettings& settings, std::uint64_t study,
                            std::optional<std::uint64_t> point, const Fields& fields);

}  // namespace oblique::server
