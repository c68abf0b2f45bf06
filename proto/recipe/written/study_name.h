#pragma once

#include <string>

namespace oblique::protocol {

/// Why a study cannot have that name, or an empty text. A name has 1 to 100 bytes of UTF-8, has no
/// control characters (text.h), and does not begin with '-'.
std::string objection_to_study_name(const std::string& name);

}  // namespace oblique::protocol
