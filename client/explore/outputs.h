#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/chunk.h"

namespace oblique::client {

/// An output that a flag names.
struct Output {
  std::string name;  ///< as it was typed
  std::string sql;   ///< over the columns of the view `runs`
};

inline constexpr std::string_view kOutputsHelp =
    "outputs, with commas between them: columns of `oblique columns`, SQL over them, or, of a "
    "mode, "
    "1 where a point has it and else 0, as mode:'sC sR' or major_mode:'sC sR'";

/// The outputs of a flag's text; commas inside quotes and brackets separate nothing. Throws
/// solver::InputError, naming the flag, for an unknown name, with the nearest, and for SQL that no
/// statement can hold.
std::vector<Output> outputs_of_flag(std::string_view flag, std::string_view text);

/// Whether the values of an output are texts, as modes.
bool has_texts(const Output& output);
/// Throws solver::InputError, naming the flag, for an output with texts.
void refuse_texts(std::string_view flag, const Output& output);

/// The number in a value of an output; NaN for NULL. Throws solver::InputError, naming the flag,
/// for a text.
double number_of(const protocol::Value& value, std::string_view flag, const Output& output);

}  // namespace oblique::client
