#pragma once

#include <csignal>
#include <cstdint>
#include <iosfwd>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

namespace oblique::protocol {

// Functions that the command lines of all three programs use.

// Exit codes.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongUsage = 2;
/// The reader of standard output has closed it. Programs that SIGPIPE ends have this exit code,
/// too.
inline constexpr int kReaderGone = 128 + SIGPIPE;

/// Returns an error message if a value is empty, as in `--db ""` or `--db=`, where CLI11 would take
/// the next word as the value. Returns an empty text if none is. The cause is often an unset
/// variable.
std::string empty_value_error(int argc, const char* const* argv);

/// Returns a check for numbers from `least` to `largest`. It refuses NaN.
CLI::Validator number_between(double least, double largest);

/// Returns a check for 64-bit whole numbers that are at least `least`.
CLI::Validator whole_number_from(std::int64_t least);

/// Name of the group of options that help and completion do not show.
inline constexpr const char* kUnlisted = "Unlisted";

/// Stores the allowed values of an option, which are used for completion only. Returns `option`.
CLI::Option* note_choices(CLI::Option* option, std::span<const std::string_view> choices);

/// Returns the message for a command-line error. For an unknown word it suggests the nearest name
/// of `command`, which is `app` or one of its commands.
std::string parse_error_message(const CLI::App& app, const CLI::App& command,
                                const CLI::ParseError& error);

/// Prints "WORDS: MESSAGE" and a hint at help to standard error. `words` are the program and
/// command as typed. Returns kWrongUsage.
int report_wrong_usage(const std::string& words, const std::string& message);

/// Flushes `out`, which is standard output. Returns `code`, kReaderGone, or kFailed after printing
/// "WORDS: MESSAGE" to standard error.
int end_output(std::ostream& out, const std::string& words, int code);

/// Parses the command line of a program without commands. Returns the exit code if the program must
/// end: that of `end_output` after --help and --version, kWrongUsage after printing an error.
std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

/// Words that complete a value, by name of the option ("--x") or of its value type ("COLUMNS").
using ValueWords = std::map<std::string, std::vector<std::string>>;

/// If the command line is `PROGRAM completion bash|zsh`, prints the completion script of `app` and
/// returns the exit code. The script is static: it contains commands, flags, choices
/// (`note_choices`) and `words`; for all other values it offers file names. Must be called after
/// all commands and options were added.
std::optional<int> print_completion(CLI::App& app, int argc, const char* const* argv,
                                    const ValueWords& words = {});

}  // namespace oblique::protocol
