#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto/program/exit_code.h"

namespace oblique::protocol {

// What the command lines of our programs share.

/// Makes an empty value of any option or argument of `app` and its verbs wrong usage: a variable of
/// a shell that is not set should not pass for a choice. To be called once all are added.
void refuse_empty_values(CLI::App& app);

/// A check for numbers from `least` to `largest`; NaN is none of them.
CLI::Validator number_between(double least, double largest);

/// A check for whole numbers from `least` on that 64 bits hold.
CLI::Validator whole_number_from(std::int64_t least);

/// Notes the values that an option may have, for completion; whoever reads the value checks it.
/// Returns `option`.
CLI::Option* note_choices(CLI::Option* option, std::span<const std::string_view> choices);

/// The noted choices; empty where there are none.
std::vector<std::string> choices_of(CLI::Option& option);

/// What is wrong with what was typed, as a sentence: a word too many with the nearest that `verb`
/// knows (of `app`, or `app` itself), or what the library says, in words that say what to do.
std::string objection_of(const CLI::App& app, const CLI::App& verb, const CLI::ParseError& error);

/// Tells on standard error what is wrong, as "oblique-server: ...", and where help is. `words` are
/// what was typed to reach it: program and verb. Gives kWrongUsage.
int tell_wrong_usage(const std::string& words, const std::string& message);

/// Parses the command line of a program without verbs. The exit code when there is nothing more to
/// do: 0 after --help and --version, which go to standard output, kWrongUsage after wrong usage,
/// which is told.
std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

}  // namespace oblique::protocol
