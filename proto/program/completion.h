#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace oblique::protocol {

/// Words that complete a value, by the name of its option ("--x") or of its type ("COLUMNS").
using ValueWords = std::map<std::string, std::vector<std::string>>;

/// Prints the completion script of `app` when the command line is `PROGRAM completion bash|zsh`,
/// and returns the exit code. The script is static: it holds verbs, flags, the choices of flags
/// (`note_choices`) and `words`, and offers file names for all other values. `app` must have all
/// its verbs and options.
std::optional<int> print_completion(CLI::App& app, int argc, const char* const* argv,
                                    const ValueWords& words = {});

}  // namespace oblique::protocol
