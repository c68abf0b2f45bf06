#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/service/source.h"
#include "proto/wire/chunk.h"

namespace oblique::client {

inline constexpr const char* kOutputsHelp =
    "outputs, separated by commas: columns of `oblique columns`, or conditions such as "
    "stick_total_s > 0 or major_mode = 'sC sR', which are 1 for points that meet them, else 0";

/// Returns the outputs that the text of --of lists, as SQL over the columns of the view `runs`.
/// Throws solver::InputError, which names `flag`, for an unknown column (with the nearest known
/// one), for an expression that a query would refuse and, without `allows_texts`, for a column of
/// texts.
std::vector<std::string> outputs_of_flag(std::string_view text, bool allows_texts,
                                         const char* flag = "--of");

/// Returns the value as a number; NaN for NULL, infinity and text.
double number_in(const protocol::Value& value);

/// Returns " Point 7 failed: " with the error of the first failed point; empty if none failed.
std::string first_failure(Source& source, const std::string& study);

/// Notes about outputs without numbers, with the same value everywhere, or with values in fewer
/// than half of the rows.
struct ValueNotes {
  std::vector<std::string> notes = {};
  bool has_values = false;

  /// `used` of `all` rows have a value of the output. `varies`: by more than rounding errors.
  void add(const std::string& output, std::uint64_t used, std::uint64_t all, bool varies);
  /// Adds the text to the last note. Throws std::runtime_error if no output has a value.
  void end(const std::string& first_failure);
};

}  // namespace oblique::client
