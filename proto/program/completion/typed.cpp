#include "proto/program/completion/typed.h"

#include <algorithm>
#include <cstddef>

namespace oblique::protocol {
namespace {

CLI::App* verb_called(CLI::App& app, const std::string& name) {
  const auto verbs =
      app.get_subcommands([&name](const CLI::App* verb) { return verb->check_name(name); });
  return verbs.empty() ? nullptr : verbs.front();
}

/// Reads one word after the other.
class WordReader {
 public:
  explicit WordReader(CLI::App& app) { typed_.verb = &app; }

  void take(const std::string& word) {
    if (takes_value(word)) {
      give(*pending_, word);
      return;
    }
    pending_ = nullptr;
    if (!words_only_ && word == "--") {
      words_only_ = true;
    } else if (!words_only_ && word.starts_with('-') && word.size() > 1) {
      take_flag(word);
    } else if (CLI::App* verb = verb_called(*typed_.verb, word)) {
      typed_.verb = verb;
    } else if (CLI::Option* place = next_place()) {
      typed_.given[place].push_back(word);
    }
  }

  Typed end(const std::string& word) {
    typed_.word = word;
    typed_.value = word;
    if (takes_value(word)) {
      typed_.option = pending_;
    } else if (!words_only_ && word.starts_with('-')) {
      end_in_flag(word);
    } else if (!typed_.verb->get_subcommands({}).empty()) {
      typed_.kind = Typed::Kind::kVerb;
    } else if (CLI::Option* place = next_place()) {
      typed_.option = place;
    } else if (word.empty()) {
      typed_.kind = Typed::Kind::kFlag;
    }
    if (typed_.option != nullptr) {
      typed_.kind = Typed::Kind::kValue;
    }
    return std::move(typed_);
  }

 private:
  /// Whether the word belongs to the flag before it.
  bool takes_value(const std::string& word) const {
    return pending_ != nullptr &&
           (taken_ < pending_->get_items_expected_min() ||
            (taken_ < pending_->get_items_expected_max() && !word.starts_with('-')));
  }

  void give(CLI::Option& option, const std::string& value) {
    typed_.given[&option].push_back(value);
    ++taken_;
  }

  void take_flag(const std::string& word) {
    const auto equals = word.find('=');
    CLI::Option* option = typed_.verb->get_option_no_throw(word.substr(0, equals));
    if (option == nullptr) {
      return;
    }
    typed_.given[option];  // it stands there
    taken_ = 0;
    if (equals != std::string::npos) {
      give(*option, word.substr(equals + 1));
    } else if (option->get_items_expected_max() > 0) {
      pending_ = option;
    }
  }

  void end_in_flag(const std::string& word) {
    const auto equals = word.find('=');
    if (equals == std::string::npos) {
      typed_.kind = Typed::Kind::kFlag;
      return;
    }
    CLI::Option* option = typed_.verb->get_option_no_throw(word.substr(0, equals));
    if (option != nullptr && option->get_items_expected_max() > 0) {
      typed_.option = option;
      typed_.value = word.substr(equals + 1);
    }
  }

  /// The first argument without a flag that has room for one more word.
  CLI::Option* next_place() {
    for (CLI::Option* option : typed_.verb->get_options()) {
      const auto found = typed_.given.find(option);
      const std::size_t taken = found == typed_.given.end() ? 0 : found->second.size();
      const auto room = static_cast<std::size_t>(std::max(option->get_items_expected_max(), 0));
      if (option->get_positional() && taken < room) {
        return option;
      }
    }
    return nullptr;
  }

  Typed typed_;
  CLI::Option* pending_ = nullptr;  // a flag that may take the next word
  int taken_ = 0;                   // values of it
  bool words_only_ = false;         // behind "--"
};

}  // namespace

Typed typed(CLI::App& app, const std::vector<std::string>& words) {
  WordReader reader(app);
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    reader.take(words[i]);
  }
  return reader.end(words.empty() ? std::string() : words.back());
}

}  // namespace oblique::protocol
