#include "client/study/toml_axis.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/written.h"
#include "proto/text.h"

namespace oblique::client {
namespace {

constexpr std::string_view kAxisForms =
    "a number, a list of numbers, { from, to, count }, { from, to, step }, { csv, column }, "
    "{ distribution, ... } or an expression in quotes";
constexpr std::array<std::string_view, 5> kRangeParts{"from", "to", "count", "step", "spacing"};
constexpr std::array<std::string_view, 2> kCsvParts{"csv", "column"};
constexpr std::array<std::string_view, 5> kDistributionParts{"distribution", "from", "to", "mean",
                                                             "sd"};

/// The table of one axis.
class AxisTable {
 public:
  AxisTable(const protocol::TomlReader& place, const solver::ParameterKey& key,
            const toml::table& table)
      : place_(place), key_(key), table_(table) {}

  protocol::Axis axis(protocol::BlockKind kind, CsvFiles& files) const {
    if (table_.contains("csv") || table_.contains("column")) {
      return csv_column(kind, files);
    }
    if (table_.contains("distribution")) {
      return distribution(kind);
    }
    return kind == protocol::BlockKind::kSample && !table_.contains("count") &&
                   !table_.contains("step") && !table_.contains("spacing")
               ? uniform()
               : range();
  }

 private:
  void check_parts(std::span<const std::string_view> known, std::string_view forms) const {
    place_.refuse_unknown(table_, known, fmt::format("{}: ", key_.name), forms);
  }

  double number(std::string_view part) const {
    return place_.number(fmt::format("{}: {}", key_.name, part), *table_.get(part), "a number");
  }
  std::optional<double> number_if_there(std::string_view part) const {
    return table_.contains(part) ? std::optional(number(part)) : std::nullopt;
  }
  std::string text(std::string_view part, std::string_view expected) const {
    return place_.text(fmt::format("{}: {}", key_.name, part), *table_.get(part), expected);
  }

  protocol::Axis csv_column(protocol::BlockKind kind, CsvFiles& files) const {
    check_parts(kCsvParts, "a column of a file is { csv = \"FILE.csv\", column = \"NAME\" }");
    if (!table_.contains("csv")) {
      place_.fail(table_, fmt::format("{}: `column` stands without `csv`, the file", key_.name));
    }
    const std::string path = text("csv", "the name of a file, in quotes");
    return place_.located(table_, [&] {
      const CsvFile& file = files.at(path);
      const bool is_only_one = !table_.contains("column") && file.columns().size() == 1;
      const std::string column = is_only_one ? file.columns().front()
                                 : table_.contains("column")
                                     ? text("column", "the name of a column, in quotes")
                                     : std::string(key_.name);
      return protocol::listed_axis(key_, file.values(column, key_), kind);
    });
  }

  protocol::Axis distribution(protocol::BlockKind kind) const {
    check_parts(kDistributionParts,
                "a distribution is { distribution = \"uniform\", from, to }, the same with "
                "\"log-uniform\", or { distribution = \"normal\", mean, sd } with `from` and `to` "
                "where it is cut off");
    const std::string name = text("distribution", "uniform, log-uniform or normal, in quotes");
    return place_.located(table_, [&] {
      return protocol::drawn_axis(
          key_,
          {protocol::distribution_named(name), number_if_there("from"), number_if_there("to"),
           number_if_there("mean"), number_if_there("sd")},
          kind);
    });
  }

  protocol::Axis uniform() const {
    check_parts(kRangeParts, "in a sample an axis is { from, to } or { distribution, ... }");
    return place_.located(table_, [&] {
      return protocol::drawn_axis(
          key_,
          {protocol::DISTRIBUTION_UNIFORM, number_if_there("from"), number_if_there("to"), {}, {}},
          protocol::BlockKind::kSample);
    });
  }

  protocol::Spacing spacing() const {
    if (!table_.contains("spacing")) {
      return protocol::SPACING_LINEAR;
    }
    const std::string name = text("spacing", "linear or log, in quotes");
    if (name != "linear" && name != "log") {
      place_.fail(*table_.get("spacing"),
                  fmt::format("{}: spacing = {} is not allowed: it must be linear or log",
                              key_.name, protocol::shown(*table_.get("spacing"))));
    }
    if (name == "log" && table_.contains("step")) {
      place_.fail(*table_.get("spacing"),
                  fmt::format("{}: a logarithmic range has no `step`: give `count`", key_.name));
    }
    return name == "log" ? protocol::SPACING_LOGARITHMIC : protocol::SPACING_LINEAR;
  }

  protocol::Axis range() const {
    check_parts(kRangeParts, "a range is { from, to, count } or { from, to, step }");
    if (!table_.contains("from") || !table_.contains("to") ||
        table_.contains("count") == table_.contains("step")) {
      place_.fail(table_,
                  fmt::format("{} = {} is not a range: give `from`, `to` and either `count` "
                              "or `step`",
                              key_.name, protocol::shown(table_)));
    }
    const double from = number("from");
    const double to = number("to");
    const auto apart = spacing();
    if (table_.contains("step")) {
      const double step = number("step");
      return place_.located(table_, [&] { return protocol::stepped_axis(key_, from, to, step); });
    }
    const auto& count = *table_.get("count");
    if (!count.is_integer()) {
      place_.located(count, [&] { protocol::throw_wrong_count(key_, protocol::shown(count)); });
    }
    return place_.located(table_, [&] {
      return protocol::counted_axis(key_, from, to, *count.value<std::int64_t>(), apart);
    });
  }

  const protocol::TomlReader& place_;
  const solver::ParameterKey& key_;
  const toml::table& table_;
};

}  // namespace

double toml_number(const protocol::TomlReader& place, const solver::ParameterKey& key,
                   const toml::node& value, std::string_view expected) {
  if (key.name != "integrator") {
    return place.number(key.name, value, expected);
  }
  const std::string name =
      place.text(key.name, value,
                 "the name of one, in quotes: " + protocol::joined(solver::integrator_names()));
  return place.located(value, [&] { return static_cast<double>(solver::integrator_named(name)); });
}

protocol::Axis axis_of_toml(const protocol::TomlReader& place, std::string_view name,
                            const toml::node& value, protocol::BlockKind kind, CsvFiles& files) {
  const auto& key = place.located(
      value, [&]() -> auto& { return protocol::axis_key(name); });
  if (const auto* table = value.as_table()) {
    return AxisTable(place, key, *table).axis(kind, files);
  }
  if (value.is_string() && value.value<std::string>()->empty()) {
    place.fail(value, fmt::format("{} = \"\" is empty: it must be {}", key.name, kAxisForms));
  }
  if (value.is_string() && key.name != "integrator") {
    return place.located(
        value, [&] { return protocol::expressed_axis(key, *value.value<std::string>()); });
  }
  std::vector<double> values;
  if (const auto* list = value.as_array()) {
    for (const auto& item : *list) {
      values.push_back(toml_number(place, key, item, kAxisForms));
      place.located(item, [&] { solver::check_value(key, values.back()); });
    }
  } else {
    values.push_back(toml_number(place, key, value, kAxisForms));
  }
  return place.located(value, [&] { return protocol::listed_axis(key, values, kind); });
}

}  // namespace oblique::client
