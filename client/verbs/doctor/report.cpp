#include "client/verbs/doctor/report.h"

#include <cctype>
#include <cstdlib>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::client::doctor {
namespace {

constexpr std::size_t kNameColumn = 2;
constexpr std::size_t kTextColumn = 18;

std::string home_folder() {
  return variable("HOME");
}

std::string shown(const std::string& text) {
  return protocol::visible(without_home(text, home_folder()));
}

/// `text` broken at spaces into lines that end before `width`, each begun at `column`. The first
/// follows what is in its line already.
void print_wrapped(std::ostream& out, const std::string& text, std::size_t column,
                   std::size_t width) {
  std::size_t at = column;
  for (const std::string_view word : protocol::split(text, ' ')) {
    if (at > column && at + 1 + word.size() > width) {
      out << '\n' << std::string(column, ' ');
      at = column;
    } else if (at > column) {
      out << ' ';
      ++at;
    }
    out << word;
    at += word.size();
  }
  out << '\n';
}

void print_facts(std::ostream& out, const Findings& findings, std::size_t width) {
  out << findings.title << '\n';
  for (const auto& fact : findings.facts) {
    if (fact.name.empty()) {
      continue;
    }
    out << fmt::format("{:{}}{:<{}}", "", kNameColumn, fact.name, kTextColumn - kNameColumn);
    print_wrapped(out, shown(fact.text), kTextColumn, width);
  }
  out << '\n';
}

/// Sentences of one kind under a heading; nothing where there are none.
void print_sentences(std::ostream& out, const std::string& heading, const Report& report,
                     std::vector<std::string> Findings::*kind, std::size_t width) {
  bool is_first = true;
  for (const auto& findings : report) {
    for (const auto& sentence : findings.*kind) {
      if (std::exchange(is_first, false)) {
        out << heading << '\n';
      }
      out << "  - ";
      constexpr std::size_t kSentenceColumn = 4;
      print_wrapped(out, shown(sentence), kSentenceColumn, width);
    }
  }
  if (!is_first) {
    out << '\n';
  }
}

std::size_t count_of(const Report& report, std::vector<std::string> Findings::*kind) {
  std::size_t count = 0;
  for (const auto& findings : report) {
    count += (findings.*kind).size();
  }
  return count;
}

nlohmann::ordered_json shown_json(const nlohmann::ordered_json& value) {
  if (value.is_string()) {
    return without_home(value.get<std::string>(), home_folder());
  }
  nlohmann::ordered_json shown = value;
  if (value.is_structured()) {
    for (auto& [key, element] : shown.items()) {
      element = shown_json(element);
    }
  }
  return shown;
}

}  // namespace

void Findings::add(const std::string& name_and_key, const std::string& text) {
  add(name_and_key, name_and_key, text, text);
}

void Findings::add(const std::string& key_of_fact, const std::string& name, const std::string& text,
                   nlohmann::ordered_json value) {
  facts.push_back({key_of_fact, name, text, std::move(value)});
}

bool is_anything_broken(const Report& report) {
  return count_of(report, &Findings::broken) > 0;
}

void print(std::ostream& out, const Report& report, std::size_t width) {
  for (const auto& findings : report) {
    if (!findings.facts.empty()) {
      print_facts(out, findings, width);
    }
  }
  print_sentences(out, "cannot work", report, &Findings::broken, width);
  print_sentences(out, "odd", report, &Findings::odd, width);
  if (count_of(report, &Findings::broken) + count_of(report, &Findings::odd) == 0) {
    out << "Nothing is odd.\n";
  }
}

nlohmann::ordered_json json_of(const Report& report) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  auto odd = nlohmann::ordered_json::array();
  auto broken = nlohmann::ordered_json::array();
  for (const auto& findings : report) {
    auto& part = json[findings.key] = nlohmann::ordered_json::object();
    for (const auto& fact : findings.facts) {
      if (!fact.key.empty()) {
        part[fact.key] = shown_json(fact.value);
      }
    }
    for (const auto& sentence : findings.odd) {
      odd.push_back(without_home(sentence, home_folder()));
    }
    for (const auto& sentence : findings.broken) {
      broken.push_back(without_home(sentence, home_folder()));
    }
  }
  json["odd"] = odd;
  json["broken"] = broken;
  return json;
}

std::string as_sentence(std::string text) {
  const std::string first = text.substr(0, text.find(' '));
  const bool is_word = first.find_first_not_of("abcdefghijklmnopqrstuvwxyz") == std::string::npos;
  if (is_word && !first.empty()) {
    text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  }
  return text.ends_with('.') ? text : text + '.';
}

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

std::string shown_milliseconds(double seconds) {
  return fmt::format("{:.3g} ms", 1e3 * seconds);
}

std::string without_home(std::string text, const std::string& home) {
  std::string folder = home;
  while (folder.size() > 1 && folder.back() == '/') {
    folder.pop_back();
  }
  if (folder.size() < 2) {
    return text;
  }
  for (auto at = text.find(folder); at != std::string::npos; at = text.find(folder, at + 1)) {
    const std::size_t behind = at + folder.size();
    const auto is_of_a_name = [](char letter) {
      return std::isalnum(static_cast<unsigned char>(letter)) != 0 || letter == '-' ||
             letter == '_' || letter == '.';
    };
    const bool begins = at == 0 || (!is_of_a_name(text[at - 1]) && text[at - 1] != '/');
    if (begins && (behind == text.size() || !is_of_a_name(text[behind]))) {
      text.replace(at, folder.size(), "~");
    }
  }
  return text;
}

}  // namespace oblique::client::doctor
