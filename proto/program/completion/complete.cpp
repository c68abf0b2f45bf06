#include "proto/program/completion/complete.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <unistd.h>

#include "proto/program/completion/bash_line.h"
#include "proto/program/exit_code.h"
#include "proto/text.h"

namespace oblique::protocol {
namespace {

constexpr std::string_view kHiddenVerb = "__complete";

/// What the script is to do beside offering what follows.
std::string order_of(const Offers& offers) {
  if (offers.files) {
    return offers.files->are_folders ? "folders" : "files " + offers.files->ending;
  }
  return offers.goes_on ? "open" : "";
}

std::string in_common(const std::vector<std::string>& texts) {
  std::string common = texts.front();
  for (const auto& text : texts) {
    const auto differs = std::mismatch(common.begin(), common.end(), text.begin(), text.end());
    common.erase(differs.first, common.end());
  }
  return common;
}

/// bash puts in what all words of an answer have in common, and lists them when that is nothing
/// more than was typed.
class BashAnswer {
 public:
  /// `type` is COMP_TYPE, `replaced` the end of the line that bash will replace.
  BashAnswer(std::string type, BashLine line, std::string replaced)
      : type_(std::move(type)), line_(std::move(line)), replaced_(std::move(replaced)) {
    if (line_.escapes && !replaced_.empty()) {
      replaced_.pop_back();
    }
  }

  std::vector<std::string> words_for(const Offers& offers) const {
    constexpr const char* kMenu = "37";
    constexpr const char* kList = "63";
    std::vector<std::string> values;
    std::vector<std::string> shown;
    for (const auto& offer : offers.offers) {
      values.push_back(offer.value);
      shown.push_back(visible(offer.shown));
    }
    if (values.empty() || (type_ == kList && values.size() > 1)) {
      return shown;
    }
    const std::string common = in_common(values);
    if (type_ == kMenu || (values.size() == 1 && !offers.goes_on)) {
      std::vector<std::string> written;
      for (const auto& value : values) {
        const std::string word = written_on(value);
        // bash adds the quote that closes one, but not behind another.
        const bool ends_quoted = line_.quote != '\0' && word.ends_with(line_.quote);
        written.push_back(ends_quoted ? word + line_.quote : word);
      }
      return written;
    }
    if (common.size() > line_.words.back().size()) {
      // Were it one word, bash would close the quotes.
      return {written_on(common), written_on(common) + ' '};
    }
    return listed(values);
  }

 private:
  /// A whole word, in the place of what is replaced.
  std::string written_on(const std::string& value) const {
    return replaced_ + written_for_bash(rest_of(value), line_.quote);
  }

  std::string_view rest_of(const std::string& value) const {
    return std::string_view(value).substr(std::min(line_.words.back().size(), value.size()));
  }

  /// To be read: they have nothing in common but what stands there.
  std::vector<std::string> listed(const std::vector<std::string>& values) const {
    std::vector<std::string> words;
    for (const auto& value : values) {
      words.push_back(replaced_ + visible(rest_of(value)));
    }
    if (in_common(words) != replaced_) {
      words.push_back(replaced_);
    }
    return words;
  }

  std::string type_;
  BashLine line_;
  std::string replaced_;
};

/// Each value, and how it is listed: with its meaning in a second column.
std::vector<std::string> words_for_zsh(const Offers& offers) {
  constexpr std::size_t kWidest = 40;
  std::size_t width = 0;
  for (const auto& offer : offers.offers) {
    width = std::max(width, std::min(offer.shown.size(), kWidest));
  }
  std::vector<std::string> words;
  for (const auto& offer : offers.offers) {
    words.push_back(offer.value);
    std::string line = visible(offer.shown);
    if (!offer.meaning.empty()) {
      line.resize(std::max(line.size(), width), ' ');
      line += "  -- " + visible(offer.meaning);
    }
    words.push_back(line);
  }
  return words;
}

std::string with_zeros(const std::string& order, const std::vector<std::string>& words) {
  std::string text = order + '\0';
  for (const auto& word : words) {
    text += word + '\0';
  }
  return text;
}

/// A line each, for fish and for people.
std::string as_lines(const Offers& offers) {
  std::string text;
  for (const auto& offer : offers.offers) {
    text += visible(offer.value);
    text += offer.meaning.empty() ? "" : "\t" + visible(offer.meaning);
    text += '\n';
  }
  return text;
}

/// `words` are what follows `__complete`.
std::string answer_to(CLI::App& app, const std::vector<std::string>& words,
                      const ValuesOf& values) {
  const auto offers_at = [&](const std::vector<std::string>& line) {
    return offers_for(typed(app, line), values);
  };
  if (words.size() == 4 && words[0] == "bash") {
    auto line = read_bash_line(words[2]);
    const std::vector<std::string> behind_program(
        line.words.begin() + (line.words.size() > 1 ? 1 : 0), line.words.end());
    const auto offers = offers_at(behind_program);
    return with_zeros(order_of(offers),
                      BashAnswer(words[1], std::move(line), words[3]).words_for(offers));
  }
  const std::vector<std::string> line(words.begin() + (words.empty() ? 0 : 1), words.end());
  const auto offers = offers_at(line);
  return !words.empty() && words[0] == "zsh" ? with_zeros(order_of(offers), words_for_zsh(offers))
                                             : as_lines(offers);
}

}  // namespace

void answer_shell(CLI::App& app, int argc, const char* const* argv, const ValuesOf& values) {
  if (argc < 2 || argv[1] != kHiddenVerb) {
    return;
  }
  try {
    const std::string answer = answer_to(app, {argv + 2, argv + argc}, values);
    std::cout.write(answer.data(), static_cast<std::streamsize>(answer.size())).flush();
  } catch (const std::exception&) {
    // There is nothing to offer.
  }
  ::_exit(kDone);
}

}  // namespace oblique::protocol
