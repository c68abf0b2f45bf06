#include "proto/program/configuration/configuration_file.h"

#include <algorithm>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include <toml++/toml.h>

#include <spdlog/fmt/fmt.h>

#include "proto/small_file.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::protocol {
namespace {

struct Scalar {
  std::string text;
  ValueKind kind;
};

/// Nothing for what is no text, number or truth value.
std::optional<Scalar> scalar_of(const toml::node& node) {
  if (const auto* text = node.as_string()) {
    return Scalar{text->get(), ValueKind::kText};
  }
  if (const auto* whole = node.as_integer()) {
    return Scalar{std::to_string(whole->get()), ValueKind::kNumber};
  }
  if (const auto* real = node.as_floating_point()) {
    return Scalar{solver::exact_number(real->get()), ValueKind::kNumber};
  }
  if (const auto* truth = node.as_boolean()) {
    return Scalar{truth->get() ? "true" : "false", ValueKind::kTruth};
  }
  return std::nullopt;
}

/// Reads one file.
class FileReader {
 public:
  explicit FileReader(const std::string& file) : file_(file) {}

  std::vector<WrittenValue> values() {
    constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
    try {
      const std::string bytes = read_small_file(file_, "the configuration file", kMostBytes);
      const toml::table top = toml::parse(std::string_view(bytes), std::string_view(file_));
      take(top, "");
    } catch (const toml::parse_error& error) {
      throw ConfigurationError(fmt::format("{}:{}: {}", file_, error.source().begin.line,
                                           excerpt(error.description(), kLongestParseError)));
    } catch (const solver::InputError& error) {
      throw ConfigurationError(error.what());
    }
    // Tables are kept by name; people read errors from the top.
    std::stable_sort(taken_.begin(), taken_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<WrittenValue> values;
    values.reserve(taken_.size());
    for (auto& [line, value] : taken_) {
      values.push_back(std::move(value));
    }
    return values;
  }

 private:
  void take(const toml::table& table, const std::string& prefix) {
    for (const auto& [name, node] : table) {
      const std::string key = prefix + std::string(name.str());
      const auto line = node.source().begin.line;
      WrittenValue value{key, fmt::format("{}:{}", file_, line), {}, ValueKind::kText, false};
      if (const auto* inner = node.as_table(); inner != nullptr && prefix.empty()) {
        take(*inner, key + ".");
        if (!inner->empty()) {
          continue;
        }
      } else {
        add(value, node);
      }
      taken_.emplace_back(line, std::move(value));
    }
  }

  static void add(WrittenValue& value, const toml::node& node) {
    const auto* const list = node.as_array();
    value.is_list = list != nullptr;
    bool is_sound = true;
    const auto add_one = [&](const toml::node& one) {
      const auto scalar = scalar_of(one);
      is_sound = is_sound && scalar && (value.values.empty() || scalar->kind == value.kind);
      if (scalar) {
        value.values.push_back(scalar->text);
        value.kind = scalar->kind;
      }
    };
    if (list == nullptr) {
      add_one(node);
    } else {
      for (const toml::node& one : *list) {
        add_one(one);
      }
    }
    if (!is_sound) {
      throw ConfigurationError(fmt::format(
          "{}: {} must be a text, a number, true or false, or a list of one kind of these",
          value.place, excerpt(value.key)));
    }
  }

  const std::string& file_;
  std::vector<std::pair<toml::source_index, WrittenValue>> taken_;
};

}  // namespace

std::vector<WrittenValue> read_configuration_file(const std::string& file) {
  return FileReader(file).values();
}

std::string toml_text(const std::string& text) {
  std::ostringstream quoted;
  const toml::value<std::string> value(text);
  quoted << toml::toml_formatter(value, toml::format_flags::none);
  return quoted.str();
}

}  // namespace oblique::protocol
