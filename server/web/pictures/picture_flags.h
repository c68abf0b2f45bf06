#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/web/answers/answer_pool.h"
#include "server/web/answers/fields.h"

// The fields of a picture, judged, as arguments of `oblique plot`. Each is one argument,
// --FLAG=VALUE, so that no value can be taken for a flag; see README.md. Throws
// std::invalid_argument, naming the field and what is allowed.
namespace oblique::server {

/// How a picture is written.
struct PictureFormat {
  std::string name;  ///< as --format has it, and the name of a file ends
  std::string content_type;
};
PictureFormat picture_format(const FieldReader& fields);

/// Of a picture of a study.
std::vector<std::string> study_picture_flags(const ServedStudy& study, const FieldReader& fields);
/// Of a picture of one of its points.
std::vector<std::string> point_picture_flags(std::uint64_t point, const FieldReader& fields);

}  // namespace oblique::server
