#include "proto/program/configuration/printed_configuration.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::protocol {
namespace {

std::string as_toml(const CLI::Option& option, const std::string& value) {
  switch (kind_of(option)) {
    case ValueKind::kText:
      return toml_text(value);
    case ValueKind::kNumber:
      return value;
    case ValueKind::kTruth:
      return CLI::detail::to_flag_value(value) > 0 ? "true" : "false";
  }
  return "";
}

/// What the option is set to, or its default; none when it has neither.
std::vector<std::string> values_of(const CLI::Option& option) {
  if (option.count() > 0) {
    return takes_list(option) ? option.results() : std::vector{option.results().back()};
  }
  if (kind_of(option) == ValueKind::kTruth) {
    return {"false"};
  }
  const std::string& by_default = option.get_default_str();
  if (takes_list(option) && by_default.starts_with('[') && by_default.ends_with(']')) {
    const std::string listed = by_default.substr(1, by_default.size() - 2);
    return listed.empty() ? std::vector<std::string>() : CLI::detail::split(listed, ',');
  }
  return by_default.empty() || by_default == "\"\"" ? std::vector<std::string>()
                                                    : std::vector{by_default};
}

}  // namespace

ValueKind kind_of(const CLI::Option& option) {
  constexpr std::array<std::string_view, 6> kNumbers{"INT",   "UINT",    "FLOAT",
                                                     "BYTES", "SECONDS", "MILLISECONDS"};
  if (option.get_items_expected_max() == 0) {
    return ValueKind::kTruth;
  }
  // Behind a colon stands what its checks say of themselves.
  const std::string described = option.get_type_name();
  const std::string_view name = std::string_view(described).substr(0, described.find(':'));
  return std::find(kNumbers.begin(), kNumbers.end(), name) != kNumbers.end() ? ValueKind::kNumber
                                                                             : ValueKind::kText;
}

bool takes_list(const CLI::Option& option) {
  return option.get_items_expected_max() > 1;
}

std::string one_line(const std::string& text) {
  return visible(text);
}

std::string printed_setting(const CLI::Option& option, const std::string& key,
                            const std::string& origin) {
  std::vector<std::string> values = values_of(option);
  if (values.empty()) {
    return fmt::format("# {} is not set\n", key);
  }
  for (std::string& value : values) {
    value = as_toml(option, value);
  }
  const std::string value =
      takes_list(option) ? fmt::format("[{}]", fmt::join(values, ", ")) : values.front();
  const std::string line = fmt::format("{} = {}", key, value);
  constexpr int kCommentColumn = 40;
  return fmt::format("{:<{}}  # {}\n", line, kCommentColumn, one_line(origin));
}

}  // namespace oblique::protocol
