#include "proto/recipe/written/study_name.h"

#include "proto/text.h"

namespace oblique::protocol {

std::string objection_to_study_name(const std::string& name) {
  constexpr std::size_t kMostBytes = 100;
  if (!name.empty() && name.size() <= kMostBytes && name.front() != '-' && is_visible(name)) {
    return {};
  }
  return "name = \"" + visible(name.substr(0, kMostBytes)) +
         "\" is not allowed: a study's name has 1 to " + std::to_string(kMostBytes) +
         " bytes of UTF-8, no control characters, marks of writing direction or zero-width "
         "characters, "
         "and does not begin with '-'";
}

}  // namespace oblique::protocol
