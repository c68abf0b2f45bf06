#pragma once

#include <string>
#include <string_view>

#include "client/study/csv_file.h"
#include "proto/oblique.pb.h"
#include "proto/recipe/blocks.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// The axis that a flag's text means: `0.4`, `0.4,0.6,0.8`, `0.1:2.0:40` (from:to:count, both ends
/// in), `0.01:2:40:log`, `0.5:1:step=0.05`, `@measured.csv:drop`, `normal(0.4,0.05)`, or an
/// expression, `A^2/(4*pi)`; `0.3:1.1` in a sample. Throws InputError naming flag, value and what
/// is allowed.
protocol::Axis axis_of_flag(const solver::ParameterKey& key, std::string_view text,
                            protocol::BlockKind kind, CsvFiles& files);

/// What `--sample` means: `sobol:100000:1`, kind:count:seed, or kind:count.
protocol::Sample sample_of_flag(std::string_view text);

/// How a key is written as a flag: `tip_mass` is --tip-mass.
std::string flag_of_key(std::string_view key);

/// A flag as it was typed, shortened for a message.
std::string shown_flag(std::string_view flag, std::string_view text);

/// A sentence about an expression without the `key = "text"` that it may begin with, for where a
/// flag that shows the text comes before it.
std::string without_text(std::string_view key, std::string_view text, const std::string& sentence);

/// Runs `work` and puts the flag before what it throws.
template <typename Work>
auto at_flag(std::string_view flag, std::string_view text, Work work) {
  try {
    return work();
  } catch (const solver::InputError& error) {
    throw solver::InputError(shown_flag(flag, text) + ": " + error.what());
  }
}

}  // namespace oblique::client
