#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

namespace oblique::protocol {

// What the command lines of the three programs share.

// Exit codes.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongUsage = 2;

/// Makes an empty value of any option or argument of `app` and its commands wrong usage: it may
/// come from an unset shell variable. Call it after all options were added.
void refuse_empty_values(CLI::App& app);

/// A check for numbers from `least` to `largest`; refuses NaN.
CLI::Validator number_between(double least, double largest);

/// A check for 64-bit whole numbers of at least `least`.
CLI::Validator whole_number_from(std::int64_t least);

/// Group of options that help and completion omit.
inline constexpr const char* kUnlisted = "Unlisted";

/// Notes the allowed values of an option, for completion only. Returns `option`.
CLI::Option* note_choices(CLI::Option* option, std::span<const std::string_view> choices);

/// The message for a command-line error. For an unknown word it suggests the nearest name of
/// `command`, which is `app` or a command of it.
std::string parse_error_message(const CLI::App& app, const CLI::App& command,
                                const CLI::ParseError& error);

/// Prints "WORDS: MESSAGE" and how to get help to standard error. `words` are the program and
/// command as typed. Returns kWrongUsage.
int report_wrong_usage(const std::string& words, const std::string& message);

/// Parses the command line of a program without commands. Returns the exit code if the program must
/// end: 0 after --help and --version, kWrongUsage after printing an error.
std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

/// Words that complete a value, by name of the option ("--x") or of its value type ("COLUMNS").
using ValueWords = std::map<std::string, std::vector<std::string>>;

/// If the command line is `PROGRAM completion bash|zsh`, prints the completion script of `app` and
/// returns the exit code. The script is static: it contains commands, flags, choices
/// (`note_choices`) and `words`, and offers file names for all other values. Call it after all
/// commands and options were added.
std::optional<int> print_completion(CLI::App& app, int argc, const char* const* argv,
                                    const ValueWords& words = {});

}  // namespace oblique::protocol
