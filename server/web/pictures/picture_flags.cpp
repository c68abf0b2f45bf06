#include "server/web/pictures/picture_flags.h"

#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/query/sql_text.h"
#include "server/web/answers/grid.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

constexpr std::size_t kLongestText = 4000;
constexpr std::uint64_t kLongestSide = 4000;

/// A part of a statement, which `oblique plot` judges once more.
std::optional<std::string> sql_field(const FieldReader& fields, const std::string& name,
                                     SqlPart part) {
  const auto text = fields.text(name);
  if (!text) {
    return std::nullopt;
  }
  if (text->size() > kLongestText || !protocol::is_visible(*text)) {
    throw std::invalid_argument(fmt::format(
        "{} must be a text of at most {} bytes without control characters", name, kLongestText));
  }
  try {
    check_sql_part(name, *text, part);
  } catch (const solver::InputError& error) {
    throw std::invalid_argument(error.what());
  }
  return text;
}

template <std::size_t kCount>
std::string one_of(const FieldReader& fields, const std::string& name, const std::string& usual,
                   const std::array<std::string_view, kCount>& allowed) {
  const std::string text = fields.text(name).value_or(usual);
  if (!text.empty() && std::find(allowed.begin(), allowed.end(), text) == allowed.end()) {
    throw std::invalid_argument(
        fmt::format("{} must be one of {}", name, fmt::join(allowed, ", ")));
  }
  return text;
}

std::string needed(const FieldReader& fields, const std::string& name, std::string_view kind) {
  auto text = sql_field(fields, name, SqlPart::kColumns);
  if (!text) {
    throw std::invalid_argument(fmt::format("{} must be given for kind={}", name, kind));
  }
  return *std::move(text);
}

/// What is drawn, and over what.
void add_kind(const FieldReader& fields, std::vector<std::string>& flags) {
  constexpr std::array<std::string_view, 4> kKinds{"map", "lines", "scatter", "histogram"};
  const std::string kind = one_of(fields, "kind", "", kKinds);
  const auto add = [&](const char* flag, const std::string& field) {
    if (const auto text = sql_field(fields, field, SqlPart::kColumns)) {
      flags.push_back(fmt::format("--{}={}", flag, *text));
    }
  };
  if (kind == "scatter") {
    flags.push_back(
        fmt::format("--scatter={},{}", needed(fields, "x", kind), needed(fields, "y", kind)));
    add("colour", "z");
    return;
  }
  if (kind == "histogram") {
    flags.push_back("--histogram=" + needed(fields, "x", kind));
    return;
  }
  if (!kind.empty()) {
    flags.push_back(fmt::format("--{}={}", kind, needed(fields, "z", kind)));
  }
  add("x", "x");
  if (kind == "lines") {
    add("by", "by");
  } else {
    add("y", "y");
  }
}

void add_look(const FieldReader& fields, std::vector<std::string>& flags) {
  for (const auto& [field, flag] : {std::pair("xlog", "--log-x"), std::pair("ylog", "--log-y"),
                                    std::pair("zlog", "--log-colour")}) {
    constexpr std::array<std::string_view, 2> kSwitch{"0", "1"};
    if (one_of(fields, field, "0", kSwitch) == "1") {
      flags.emplace_back(flag);
    }
  }
  const auto from = fields.number("from");
  const auto to = fields.number("to");
  if (from.has_value() != to.has_value()) {
    throw std::invalid_argument("from and to must both be given, or none of them");
  }
  if (from) {
    flags.push_back(
        fmt::format("--range={}:{}", solver::exact_number(*from), solver::exact_number(*to)));
  }
}

void add_form(const FieldReader& fields, std::vector<std::string>& flags) {
  const auto width = fields.whole("width");
  const auto height = fields.whole("height");
  if (width.has_value() != height.has_value() || width.value_or(1) > kLongestSide ||
      height.value_or(1) > kLongestSide) {
    throw std::invalid_argument(fmt::format(
        "width and height must both be given, or none of them, and be at most {}", kLongestSide));
  }
  if (width) {
    flags.push_back(fmt::format("--size={}x{}", *width, *height));
  }
  flags.push_back("--format=" + picture_format(fields).name);
}

}  // namespace

PictureFormat picture_format(const FieldReader& fields) {
  constexpr std::array<std::string_view, 4> kFormats{"svg", "png", "csv", "gp"};
  constexpr std::array<std::string_view, 4> kTypes{
      "image/svg+xml", "image/png", "text/csv; charset=utf-8", "text/plain; charset=utf-8"};
  std::string name = one_of(fields, "format", "svg", kFormats);
  const auto place = std::find(kFormats.begin(), kFormats.end(), name) - kFormats.begin();
  return {std::move(name), std::string(kTypes.at(static_cast<std::size_t>(place)))};
}

std::vector<std::string> study_picture_flags(const ServedStudy& study, const FieldReader& fields) {
  std::vector<std::string> flags;
  add_kind(fields, flags);
  for (const GridPlace& place : grid_places(*study.table, fields)) {
    flags.push_back(fmt::format("--at={}={}", place.key, solver::exact_number(place.value)));
  }
  if (const auto block = fields.whole("block")) {
    flags.push_back(fmt::format("--block={}", *block + 1));
  }
  if (const auto where = sql_field(fields, "where", SqlPart::kCondition)) {
    flags.push_back("--where=" + *where);
  }
  add_look(fields, flags);
  add_form(fields, flags);
  return flags;
}

std::vector<std::string> point_picture_flags(std::uint64_t point, const FieldReader& fields) {
  constexpr std::array<std::string_view, 6> kPanels{"forces",     "loop",     "deformation",
                                                    "velocities", "energies", "shape"};
  std::vector<std::string> flags{fmt::format("--point={}", point)};
  if (const std::string panel = one_of(fields, "panel", "", kPanels); !panel.empty()) {
    flags.push_back("--panel=" + panel);
  }
  add_form(fields, flags);
  return flags;
}

}  // namespace oblique::server
