#include "client/study/flag_axis.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/expression.h"
#include "proto/recipe/written.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::InputError;
using solver::ParameterKey;

constexpr std::string_view kStep = "step=";

/// The number that a part of a flag's text says.
double flag_number(std::string_view part) {
  const auto value = solver::number_of(part);
  if (!value) {
    throw InputError(
        (part.empty() ? "a value is missing" : fmt::format("\"{}\" is not a number", part)) +
        "; write one value (0.4), a list (0.4,0.6,0.8), a range from:to:count (0.1:2.0:40), "
        "@FILE.csv:COLUMN, normal(MEAN,SD) in a sample, or an expression (A^2/(4*pi))");
  }
  return *value;
}

std::optional<std::int64_t> whole_number(std::string_view part) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
  return error == std::errc() && end == part.data() + part.size() ? std::optional(value)
                                                                  : std::nullopt;
}

protocol::Spacing spacing_of(std::string_view part) {
  if (part != "log" && part != "linear") {
    throw InputError(fmt::format(
        "\"{}\" is no spacing: write from:to:count:log for a logarithmic range, as 0.01:2:40:log",
        part));
  }
  return part == "log" ? protocol::SPACING_LOGARITHMIC : protocol::SPACING_LINEAR;
}

protocol::Axis range_of_flag(const ParameterKey& key, std::string_view text,
                             protocol::BlockKind kind) {
  constexpr std::size_t kMostParts = 4;
  const auto parts = protocol::split(text, ':');
  if (kind == protocol::BlockKind::kSample && parts.size() == 2) {
    return protocol::drawn_axis(
        key, {protocol::DISTRIBUTION_UNIFORM, flag_number(parts[0]), flag_number(parts[1]), {}, {}},
        kind);
  }
  if (parts.size() < 3 || parts.size() > kMostParts) {
    throw InputError(
        "this is not a range: write from:to:count, as 0.1:2.0:40, from:to:count:log or "
        "from:to:step=0.05" +
        std::string(parts.size() == 2 ? "; from:to alone stands in a --sample" : ""));
  }
  const double from = flag_number(parts[0]);
  const double to = flag_number(parts[1]);
  const auto spacing = parts.size() == kMostParts ? spacing_of(parts[3]) : protocol::SPACING_LINEAR;
  if (parts[2].starts_with(kStep)) {
    if (parts.size() == kMostParts) {
      throw InputError("a step has no spacing: write from:to:count:log for a logarithmic range");
    }
    return protocol::stepped_axis(key, from, to, flag_number(parts[2].substr(kStep.size())));
  }
  const auto count = whole_number(parts[2]);
  if (!count) {
    protocol::throw_wrong_count(key, parts[2]);
  }
  return protocol::counted_axis(key, from, to, *count, spacing);
}

/// @FILE:COLUMN, or @FILE for its only column or the one that is called as the key.
protocol::Axis column_of_flag(const ParameterKey& key, std::string_view text,
                              protocol::BlockKind kind, CsvFiles& files) {
  const auto colon = text.rfind(':');
  const std::string path(text.substr(1, colon == std::string_view::npos ? colon : colon - 1));
  const CsvFile& file = files.at(path);
  std::string column(key.name);
  if (colon != std::string_view::npos) {
    column = text.substr(colon + 1);
  } else if (file.columns().size() == 1) {
    column = file.columns().front();
  }
  return protocol::listed_axis(key, file.values(column, key), kind);
}

/// normal(MEAN,SD), normal(MEAN,SD,FROM,TO) with either end left empty, uniform(FROM,TO) or
/// log-uniform(FROM,TO); nothing for another text.
std::optional<protocol::WrittenDistribution> distribution_of_flag(std::string_view text) {
  const auto bracket = text.find('(');
  const auto& names = protocol::distribution_names();
  if (bracket == std::string_view::npos || !text.ends_with(')') ||
      std::find(names.begin(), names.end(), text.substr(0, bracket)) == names.end()) {
    return std::nullopt;
  }
  protocol::WrittenDistribution written;
  written.kind = protocol::distribution_named(text.substr(0, bracket));
  const auto parts = protocol::split(text.substr(bracket + 1, text.size() - bracket - 2), ',');
  const bool is_normal = written.kind == protocol::DISTRIBUTION_NORMAL;
  if (is_normal ? parts.size() < 2 || parts.size() > 4 : parts.size() != 2) {
    throw InputError(is_normal ? "write normal(MEAN,SD), or normal(MEAN,SD,FROM,TO) to cut it off"
                               : fmt::format("write {}(FROM,TO)", name_of(written.kind)));
  }
  const auto end = [&](std::size_t i) {
    return i < parts.size() && !parts[i].empty() ? std::optional(flag_number(parts[i]))
                                                 : std::nullopt;
  };
  if (is_normal) {
    written.mean = flag_number(parts[0]);
    written.sd = flag_number(parts[1]);
    written.from = end(2);
    written.to = end(3);
  } else {
    written.from = flag_number(parts[0]);
    written.to = flag_number(parts[1]);
  }
  return written;
}

/// A distribution that was misspelt would be called an unknown function.
void check_distribution_name(std::string_view text, protocol::BlockKind kind) {
  const std::string_view name = text.substr(0, std::min(text.find('('), text.size()));
  auto known = expressions::function_names();
  if (kind != protocol::BlockKind::kSample || name.size() == text.size() ||
      std::find(known.begin(), known.end(), name) != known.end() ||
      name.find_first_of("+*/^)<>=!&| ") != std::string_view::npos) {
    return;
  }
  const auto& names = protocol::distribution_names();
  known.insert(known.end(), names.begin(), names.end());
  const auto nearest = protocol::nearest(name, known);
  if (std::find(names.begin(), names.end(), nearest) != names.end()) {
    throw InputError(fmt::format("there is no distribution `{}`{}; there are {}", name,
                                 protocol::did_you_mean(name, known), protocol::joined(names)));
  }
}

/// Whether a text that is no number means an expression: it computes, or names another key. What is
/// neither is a slip, and better told so.
bool is_expression(std::string_view text) {
  const auto is_number = [](std::string_view part) {
    return part.empty() || solver::number_of(part).has_value();
  };
  const auto parts = protocol::split(text, ',');
  if (std::all_of(parts.begin(), parts.end(), is_number)) {
    return false;
  }
  return text.find_first_of("+-*/^()<>=!&|") != std::string_view::npos ||
         protocol::is_axis_key(text);
}

std::vector<double> numbers_of_flag(std::string_view text) {
  std::vector<double> values;
  for (const auto part : protocol::split(text, ',')) {
    values.push_back(flag_number(part));
  }
  return values;
}

protocol::Axis axis_of_expression(const ParameterKey& key, std::string_view text) {
  try {
    return protocol::expressed_axis(key, text);
  } catch (const InputError& error) {
    throw InputError(without_text(key.name, text, error.what()));
  }
}

std::vector<double> integrators(std::string_view text) {
  std::vector<double> values;
  for (const auto name : protocol::split(text, ',')) {
    values.push_back(static_cast<double>(solver::integrator_named(name)));
  }
  return values;
}

}  // namespace

std::string flag_of_key(std::string_view key) {
  std::string flag = "--" + std::string(key);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

std::string shown_flag(std::string_view flag, std::string_view text) {
  return fmt::format("{} {}", flag, protocol::excerpt(text));
}

std::string without_text(std::string_view key, std::string_view text, const std::string& sentence) {
  const std::string words = protocol::expression_in_words(key, std::string(text));
  if (!sentence.starts_with(words)) {
    return sentence;
  }
  const std::string rest = sentence.substr(words.size());
  return rest.starts_with(": ") ? rest.substr(2) : "it" + rest;
}

protocol::Axis axis_of_flag(const ParameterKey& key, std::string_view text,
                            protocol::BlockKind kind, CsvFiles& files) {
  return at_flag(flag_of_key(key.name), text, [&] {
    if (text.starts_with('@')) {
      return column_of_flag(key, text, kind, files);
    }
    if (key.name == "integrator") {
      return protocol::listed_axis(key, integrators(text), kind);
    }
    if (const auto written = distribution_of_flag(text)) {
      return protocol::drawn_axis(key, *written, kind);
    }
    check_distribution_name(text, kind);
    // As in C: the error of the expression tells how to choose.
    const bool chooses = text.find('?') != std::string_view::npos;
    if (!chooses && text.find(':') != std::string_view::npos) {
      return range_of_flag(key, text, kind);
    }
    return chooses || is_expression(text) ? axis_of_expression(key, text)
                                          : protocol::listed_axis(key, numbers_of_flag(text), kind);
  });
}

protocol::Sample sample_of_flag(std::string_view text) {
  return at_flag("--sample", text, [&] {
    const auto parts = protocol::split(text, ':');
    const auto count = parts.size() > 1 ? whole_number(parts[1]) : std::nullopt;
    const auto seed = parts.size() > 2 ? whole_number(parts[2]) : protocol::kUsualSeed;
    if (parts.size() > 3 || !count || !seed) {
      throw InputError(
          "this is no sample: write kind:count:seed, as sobol:100000:1; kinds are random, lhs and "
          "sobol, count and seed whole numbers");
    }
    return protocol::written_sample(parts[0], *count, *seed);
  });
}

}  // namespace oblique::client
