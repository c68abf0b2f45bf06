
#include <iostream>
#include <string_view>

#include "proto/program/usage.h"

namespace oblique::protocol {
namespace {

// NAME stands for the program, CASES for the words that are offered. A key of CASES is a verb, or a
// verb and a flag that takes a value.
constexpr std::string_view kBothShells = R"(_NAME_offers() {
  case $1 in
CASES    *) return 1 ;;
  esac
}
# Sets `verb` to the verb in the words.
_NAME_verb() {
  local each
  verb=''
  for each; do
    if [[ $each != -* ]] && _NAME_offers "${verb:+$verb }$each"; then
      verb=${verb:+$verb }$each
    fi
  done
}
)";

constexpr std::string_view kBash =
    R"(# Completion of bash for NAME, as `NAME completion bash` prints it.
BOTH_SHELLS_NAME() {
  local word=${2-} verb before=${COMP_WORDS[COMP_CWORD - 1]} offers=()
  _NAME_verb "${COMP_WORDS[@]:1:COMP_CWORD-1}"
  # bash makes three words of --flag=value.
  [[ $before != '=' ]] || before=${COMP_WORDS[COMP_CWORD - 2]}
  if [[ $before != --* ]] || ! _NAME_offers "${verb:+$verb }$before"; then
    _NAME_offers "$verb"
    [[ $word == -* ]] || offers=("${offers[@]/#-*/}")
  fi
  # The last item of a list, or the last name of an expression.
  local head=${word%"${word##*[ ,(]}"}
  mapfile -t COMPREPLY < <(compgen -P "$head" -W "${offers[*]}" -- "${word#"$head"}")
}
complete -o default -F _NAME NAME
)";

constexpr std::string_view kZsh = R"(#compdef NAME
# Completion of zsh for NAME, as `NAME completion zsh` prints it.
BOTH_SHELLS_NAME() {
  local verb before=$words[CURRENT-1]
  local -a offers
  _NAME_verb "${(@)words[2,CURRENT-1]}"
  if [[ $PREFIX == --*=* ]]; then
    before=${PREFIX%%=*}
    compset -P '--*='
  fi
  if [[ $before == --* ]] && _NAME_offers "${verb:+$verb }$before"; then
    # The last item of a list, or the last name of an expression.
    compset -P '*[ ,(]'
  else
    _NAME_offers "$verb"
    if [[ $PREFIX == -* ]]; then
      offers=(${(M)offers:#-*})
    else
      offers=(${offers:#-*})
    fi
  fi
  ((${#offers})) && _describe NAME offers || _files
}
if [[ $funcstack[1] == _NAME ]]; then
  _NAME "$@"
else
  compdef _NAME NAME
fi
)";

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string quoted(const std::string& text) {
  return "'" + replaced(text, "'", R"('\'')") + "'";
}

/// The cases of a script.
class Cases {
 public:
  explicit Cases(const ValueWords& words) : words_(words) {}

  /// Adds those of a verb, which is reached by the words `path`, and of its verbs.
  void add(CLI::App& verb, const std::string& path) {
    const std::string before = path.empty() ? "" : path + ' ';
    std::string offers;
    std::string without_words;
    for (auto* each : verb.get_subcommands({})) {
      offers += ' ' + quoted(each->get_name());
      add(*each, before + each->get_name());
    }
    for (auto* option : verb.get_options()) {
      const std::string values = values_of(*option);
      offers += option->get_positional() ? values : "";
      for (const std::string& name : option->get_lnames()) {
        const std::string flag = "--" + name;
        offers += ' ' + quoted(flag);
        if (!values.empty()) {
          add_case(quoted(before + flag), values);
        } else if (option->get_items_expected_min() > 0) {
          without_words += (without_words.empty() ? "" : "|") + quoted(before + flag);
        }
      }
    }
    if (!without_words.empty()) {
      add_case(without_words, "");
    }
    add_case(quoted(path), offers);
  }

  const std::string& text() const { return text_; }

 private:
  void add_case(const std::string& keys, const std::string& offers) {
    text_ += "    " + keys + ") offers=(" + offers + ") ;;\n";
  }

  std::string values_of(CLI::Option& option) const {
    std::vector<std::string> values = choices_of(option);
    for (const std::string& key : {option.get_type_name(), option.get_name()}) {
      if (const auto known = words_.find(key); values.empty() && known != words_.end()) {
        values = known->second;
      }
    }
    std::string offers;
    for (const std::string& value : values) {
      offers += ' ' + quoted(value);
    }
    return offers;
  }

  const ValueWords& words_;
  std::string text_;
};

}  // namespace

std::optional<int> print_completion(CLI::App& app, int argc, const char* const* argv,
                                    const ValueWords& words) {
  if (argc < 2 || std::string_view(argv[1]) != "completion") {
    return std::nullopt;
  }
  const std::string_view shell = argc == 3 ? argv[2] : "";
  if (shell != "bash" && shell != "zsh") {
    return tell_wrong_usage(app.get_name(), "write `completion bash` or `completion zsh`");
  }
  Cases cases(words);
  cases.add(app, "");
  const std::string script =
      replaced(std::string(shell == "zsh" ? kZsh : kBash), "BOTH_SHELLS", kBothShells);
  std::cout << replaced(replaced(script, "NAME", app.get_name()), "CASES", cases.text());
  return std::cout.flush() ? kDone : kFailed;
}

}  // namespace oblique::protocol
