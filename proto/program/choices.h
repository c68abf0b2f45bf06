#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

namespace oblique::protocol {

/// Notes that the option is one of `choices`, which completion then offers. Whoever reads the value
/// judges it, in words of his own. Gives `option`.
CLI::Option* note_choices(CLI::Option* option, std::span<const std::string_view> choices);

/// The choices that were noted; none where there were not.
std::vector<std::string> choices_of(CLI::Option& option);

}  // namespace oblique::protocol
