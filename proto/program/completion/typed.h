#pragma once

#include <map>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace oblique::protocol {

/// What has been typed of a command line, up to the word that is to be completed.
struct Typed {
  /// What the word may become.
  enum class Kind { kVerb, kFlag, kValue, kNothing };

  CLI::App* verb = nullptr;       ///< the innermost that was named, or the program itself
  Kind kind = Kind::kNothing;     ///< of the last word
  CLI::Option* option = nullptr;  ///< whose value the last word is; null for the other kinds
  std::string word;               ///< the beginning of the last word, without quotes
  std::string value;              ///< of the value: `word` without "--flag=" before it
  std::map<const CLI::Option*, std::vector<std::string>> given;  ///< complete values before it
};

/// Reads the words behind the program's name as the program itself would; the last is the one that
/// is to be completed, and may be empty. Words that are wrong are passed over.
Typed typed(CLI::App& app, const std::vector<std::string>& words);

}  // namespace oblique::protocol
