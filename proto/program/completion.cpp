#include "proto/program/usage.h"

#include <iostream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

namespace oblique::protocol {
namespace {

// Template of the completion script. NAME is replaced by the name of the program, and CASES by the
// branches of the `case` below. The pattern of a branch is a command, or a command and a flag that
// takes a value. The branch lists the words to offer.
constexpr std::string_view kBothShells = R"(_NAME_offers() {
  case $1 in
CASES    *) return 1 ;;
  esac
}
# Sets `command` to the command in the words.
_NAME_command() {
  local each
  command=''
  for each; do
    if [[ $each != -* ]] && _NAME_offers "${command:+$command }$each"; then
      command=${command:+$command }$each
    fi
  done
}
)";

constexpr std::string_view kBash =
    R"(# Completion of bash for NAME, as `NAME completion bash` prints it.
BOTH_SHELLS_NAME() {
  local word=${2-} command before=${COMP_WORDS[COMP_CWORD - 1]} offers=()
  _NAME_command "${COMP_WORDS[@]:1:COMP_CWORD-1}"
  # bash makes three words of --flag=value.
  [[ $before != '=' ]] || before=${COMP_WORDS[COMP_CWORD - 2]}
  if [[ $before != --* ]] || ! _NAME_offers "${command:+$command }$before"; then
    _NAME_offers "$command"
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
  local command before=$words[CURRENT-1]
  local -a offers
  _NAME_command "${(@)words[2,CURRENT-1]}"
  if [[ $PREFIX == --*=* ]]; then
    before=${PREFIX%%=*}
    compset -P '--*='
  fi
  if [[ $before == --* ]] && _NAME_offers "${command:+$command }$before"; then
    # The last item of a list, or the last name of an expression.
    compset -P '*[ ,(]'
  else
    _NAME_offers "$command"
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

/// Name of a check that is never active and not shown by help. Its description contains the allowed
/// values of an option, because CLI11 has no other place for them.
constexpr const char* kChoices = "choices";

std::string values_of(CLI::Option& option, const ValueWords& words) {
  std::vector<std::string> values;
  for (const std::string& key : {option.get_name(), option.get_type_name()}) {
    if (const auto known = words.find(key); known != words.end()) {
      values = known->second;
    }
  }
  try {
    // Activates the check for a moment, because the description of an inactive check is empty.
    values = CLI::detail::split(option.get_validator(kChoices)->active().get_description(), ' ');
    option.get_validator(kChoices)->active(false);
  } catch (const CLI::OptionNotFound&) {  // the option has no choices
  }
  std::string offers;
  for (const std::string& value : values) {
    offers += ' ' + quoted(value);
  }
  return offers;
}

/// Returns the branches of the script's `case` for a command and its subcommands. `path` is the
/// command as typed after PROGRAM.
std::string cases_of(CLI::App& command, const std::string& path, const ValueWords& words) {
  std::string cases;
  std::string offers;
  const auto add_case = [&cases](const std::string& key, const std::string& values) {
    cases += "    " + quoted(key) + ") offers=(" + values + ") ;;\n";
  };
  const std::string before = path.empty() ? "" : path + ' ';
  for (auto* each : command.get_subcommands({})) {
    offers += ' ' + quoted(each->get_name());
    cases += cases_of(*each, before + each->get_name(), words);
  }
  for (auto* option : command.get_options()) {
    if (option->get_group().empty() || option->get_group() == kUnlisted) {
      continue;
    }
    const std::string values = values_of(*option, words);
    offers += option->get_positional() ? values : "";
    for (const std::string& name : option->get_lnames()) {
      offers += ' ' + quoted("--" + name);
      if (option->get_items_expected_max() > 0) {
        add_case(before + "--" + name, values);
      }
    }
  }
  add_case(path, offers);
  return cases;
}

}  // namespace

CLI::Option* note_choices(CLI::Option* option, std::span<const std::string_view> choices) {
  return option->check(
      CLI::Validator(fmt::format("{}", fmt::join(choices, " "))).name(kChoices).active(false));
}

std::optional<int> print_completion(CLI::App& app, int argc, const char* const* argv,
                                    const ValueWords& words) {
  if (argc < 2 || std::string_view(argv[1]) != "completion") {
    return std::nullopt;
  }
  const std::string_view shell = argc == 3 ? argv[2] : "";
  if (shell != "bash" && shell != "zsh") {
    return report_wrong_usage(app.get_name(), "write `completion bash` or `completion zsh`");
  }
  const std::string script =
      replaced(std::string(shell == "zsh" ? kZsh : kBash), "BOTH_SHELLS", kBothShells);
  std::cout << replaced(replaced(script, "NAME", app.get_name()), "CASES",
                        cases_of(app, "", words));
  return end_output(std::cout, app.get_name(), kDone);
}

}  // namespace oblique::protocol
