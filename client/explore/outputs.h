#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/chunk.h"

namespace oblique::client {

inline constexpr const char* kOutputsHelp =
    "outputs, separated by commas: columns of `oblique columns`, or conditions such as "
    "stick_total_s > 0 or major_mode = 'sC sR', which are 1 for points that meet them, else 0";

/// The outputs that the text of --of lists, as SQL over the columns of the view `runs`. Throws
/// solver::InputError for an unknown column, with the nearest, for text that no statement can
/// contain, and without `allows_texts` for a column of texts. `flag` is named in errors.
std::vector<std::string> outputs_of_flag(std::string_view text, bool allows_texts,
                                         std::string_view flag = "--of");

/// The number of a value; NaN for NULL and for text.
double number_in(const protocol::Value& value);

}  // namespace oblique::client
