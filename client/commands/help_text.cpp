#include "client/commands/help_text.h"

#include <optional>
#include <sstream>
#include <string_view>

namespace oblique::client {
namespace {

/// How far the rest of a line that is too long is indented; nothing: the line is left whole.
std::optional<std::size_t> indent_of_rest(std::string_view line, std::size_t column) {
  if (!line.starts_with(' ')) {
    return 0;
  }
  const bool has_meaning = line.size() > column && line[column - 1] == ' ' && line[column] != ' ';
  // Between a command and a remark beside it there is such a place too.
  return has_meaning && !line.starts_with("  oblique ") ? std::optional(column) : std::nullopt;
}

/// Where a line of at most `width` characters ends: at a space behind `from`, or at the end.
std::size_t break_of(std::string_view line, std::size_t from, std::size_t width) {
  const std::size_t space = line.rfind(' ', width);
  return space != std::string_view::npos && space > from ? space : line.find(' ', width);
}

}  // namespace

std::string fitted_help(const std::string& help, std::size_t width, std::size_t column) {
  std::istringstream lines(help);
  std::string text;
  std::string rest;  // of a sentence, which the next line may go on with
  for (std::string line; std::getline(lines, line);) {
    const bool goes_on = !rest.empty() && !line.empty() && !line.starts_with(' ');
    if (!rest.empty() && !goes_on) {
      text += rest + '\n';
    }
    line = goes_on ? rest + ' ' + line : line;
    rest.clear();
    const auto indent = indent_of_rest(line, column);
    while (indent && *indent < width && line.size() > width) {
      const std::size_t end = break_of(line, *indent, width);
      if (end == std::string::npos) {
        break;
      }
      text += line.substr(0, end) + '\n';
      line = std::string(*indent, ' ') + line.substr(end + 1);
      rest = *indent == 0 ? line : "";
    }
    text += rest.empty() ? line + '\n' : "";
  }
  return rest.empty() ? text : text + rest + '\n';
}

}  // namespace oblique::client
