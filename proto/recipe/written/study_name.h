#pragma once

#include <string>

namespace oblique::protocol {

/// Why no study can be called so, or an empty text: a name has 1 to 100 bytes of UTF-8, none of
/// them part of a control character (text.h), and does not begin with '-'.
std::string objection_to_study_name(const std::string& name);

}  // namespace oblique::protocol
