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

// What the command lines of our programs share.

// Exit codes.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongUsage = 2;

/// Makes an empty value of any option or argument of `app` and its commands wrong usage: it may
/// come from a shell variable that is not set. Call it after all options are added.
void refuse_empty_values(CLI::App& app);

/// A check for numbers from `least` to `largest`; NaN is refused.
CLI::Validator number_between(double least, double largest);

/// A check for whole numbers of 64 bits that are at least `least`.
CLI::Validator whole_number_from(std::int64_t least);

/// Group of options that neither help nor completion lists.
inline constexpr const char* kUnlisted = "Unlisted";

/// Notes the values that an option may have, for completion; the reader of the value checks it.
/// Returns `option`.
CLI::Option* note_choices(CLI::Option* option, std::span<const std::string_view> choices);

/// The sentence for an error of the command line. An unexpected word gets the nearest name that
/// `command` (of `app`, or `app` itself) has.
std::string parse_error_message(const CLI::App& app, const CLI::App& command,
                                const CLI::ParseError& error);

/// Prints the message on standard error, as "oblique-server: ...", with the command for help.
/// `words` are program and command as typed. Returns kWrongUsage.
int report_wrong_usage(const std::string& words, const std::string& message);

/// Parses the command line of a program without commands. Returns the exit code when the program is
/// to end: 0 after --help and --version, kWrongUsage after an error, which it has printed.
std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

/// Words that complete a value, by the name of its option ("--x") or of its type ("COLUMNS").
using ValueWords = std::map<std::string, std::vector<std::string>>;

/// Prints the completion script of `app` when the command line is `PROGRAM completion bash|zsh`,
/// and returns the exit code. The script is static: it holds commands, flags, the choices of flags
/// (`note_choices`) and `words`, and offers file names for all other values. `app` must have all
/// its commands and options.
std::optional<int> print_completion(CLI::App& app, int argc, const char* const* argv,
                                    const ValueWords& words = {});

}  // namespace oblique::protocol
