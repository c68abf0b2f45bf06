#pragma once

#include <cstddef>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace oblique::client::doctor {

/// One thing that was looked at.
struct Fact {
  std::string key;               ///< in JSON; empty: for people alone
  std::string name;              ///< for people; empty: in JSON alone
  std::string text;              ///< the same
  nlohmann::ordered_json value;  ///< in JSON
};

/// What one part of the examination gave.
struct Findings {
  std::string key;    ///< in JSON
  std::string title;  ///< for people
  std::vector<Fact> facts = {};
  std::vector<std::string> odd = {};     ///< sentences that say what to do
  std::vector<std::string> broken = {};  ///< the same, of what keeps something from working

  void add(const std::string& name_and_key, const std::string& text);
  void add(const std::string& key_of_fact, const std::string& name, const std::string& text,
           nlohmann::ordered_json value);
  /// For JSON alone.
  void note(const std::string& key_of_fact, nlohmann::ordered_json value) {
    add(key_of_fact, "", "", std::move(value));
  }
};

using Report = std::vector<Findings>;

/// Whether something was found that cannot work.
bool is_anything_broken(const Report& report);

/// For people, in lines of at most `width` characters where words allow it.
void print(std::ostream& out, const Report& report, std::size_t width);

/// As one object: an object a part, and the lists `odd` and `broken`.
nlohmann::ordered_json json_of(const Report& report);

/// What an error says, as a sentence of its own.
std::string as_sentence(std::string text);

/// A variable of the environment; empty where it is not set.
std::string variable(const char* name);

/// To two digits or more: "0.071 ms".
std::string shown_milliseconds(double seconds);

/// `text` with ~ in the place of the home folder, wherever that stands in it.
std::string without_home(std::string text, const std::string& home);

}  // namespace oblique::client::doctor
