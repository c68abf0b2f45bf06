#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace oblique::protocol {

/// A command line of bash up to the cursor, read as bash does; nothing in it is expanded.
struct BashLine {
  std::vector<std::string> words;  ///< without quotes; the last is the one at the cursor
  char quote = '\0';               ///< that is open at the cursor, ' or "; 0: none
  bool escapes = false;            ///< a backslash is the last that was typed
};

/// The words of the last command on the line, without assignments before it.
BashLine read_bash_line(std::string_view line);

/// `text` as it is to be written on such a line where `quote` is open (0: none), so that it means
/// just that.
std::string written_for_bash(std::string_view text, char quote);

}  // namespace oblique::protocol
