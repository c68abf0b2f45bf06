#include "proto/program/completion/bash_line.h"

#include <algorithm>
#include <cctype>
#include <cstddef>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::protocol {
namespace {

constexpr std::string_view kBlanks = " \t\n";
/// That end a word outside quotes, and perhaps a command.
constexpr std::string_view kOperators = ";|&()<>";
/// That a backslash makes plain between double quotes.
constexpr std::string_view kSpecialInQuotes = "\"\\$`";

bool is_assignment(const std::string& word) {
  const auto equals = word.find('=');
  return equals != std::string::npos && equals > 0 &&
         std::all_of(word.begin(), word.begin() + static_cast<std::ptrdiff_t>(equals),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

class LineReader {
 public:
  void take(char c) {
    if (escaped_) {
      if (line_.quote == '"' && kSpecialInQuotes.find(c) == std::string_view::npos) {
        word_ += '\\';
      }
      add(c);
      escaped_ = false;
    } else if (c == '\\' && line_.quote != '\'') {
      escaped_ = true;
    } else if (line_.quote != '\0') {
      c == line_.quote ? void(line_.quote = '\0') : add(c);
    } else if (c == '\'' || c == '"') {
      line_.quote = c;
      is_word_ = true;
    } else if (kBlanks.find(c) != std::string_view::npos) {
      end_word();
    } else if (kOperators.find(c) != std::string_view::npos) {
      end_word();
      if (c != '<' && c != '>') {
        line_.words.clear();
      }
    } else {
      add(c);
    }
  }

  BashLine end() {
    line_.words.push_back(word_);
    line_.escapes = escaped_;
    return std::move(line_);
  }

 private:
  void add(char c) {
    word_ += c;
    is_word_ = true;
  }
  void end_word() {
    if (is_word_ && !(line_.words.empty() && is_assignment(word_))) {
      line_.words.push_back(word_);
    }
    word_.clear();
    is_word_ = false;
  }

  BashLine line_;
  std::string word_;
  bool is_word_ = false;  // also an empty one, in quotes
  bool escaped_ = false;
};

/// $'...', in which bash writes what a line does not show.
std::string in_ansi_quotes(std::string_view bytes) {
  std::string quoted = "$'";
  for (const char c : bytes) {
    quoted += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  }
  return quoted + "'";
}

std::string unquoted(std::string_view character) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=,@%+";
  const bool is_plain =
      character.size() > 1 || kPlain.find(character.front()) != std::string_view::npos;
  return (is_plain ? "" : "\\") + std::string(character);
}

std::string in_quotes(std::string_view character, char quote) {
  const char c = character.front();
  if (quote == '\'' && c == '\'') {
    return "'\\''";
  }
  if (quote == '"' && c == '!') {  // a backslash before it would stay
    return "\"'!'\"";
  }
  const bool is_special = quote == '"' && kSpecialInQuotes.find(c) != std::string_view::npos;
  return (is_special ? "\\" : "") + std::string(character);
}

}  // namespace

BashLine read_bash_line(std::string_view line) {
  LineReader reader;
  for (const char c : line) {
    reader.take(c);
  }
  return reader.end();
}

std::string written_for_bash(std::string_view text, char quote) {
  std::string written;
  while (!text.empty()) {
    const auto first = first_character(text);
    const auto character = text.substr(0, std::max<std::size_t>(first.bytes, 1));
    if (first.bytes == 0 || is_control(first.code)) {
      const std::string pause(quote == '\0' ? 0 : 1, quote);
      written += pause + in_ansi_quotes(character) + pause;
    } else {
      written += quote == '\0' ? unquoted(character) : in_quotes(character, quote);
    }
    text.remove_prefix(character.size());
  }
  return written;
}

}  // namespace oblique::protocol
