#include "server/web/answers/fields.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"

namespace oblique::server {
namespace {

template <typename Number>
std::optional<Number> read_as(const std::string& text) {
  Number number{};
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && rest == end ? std::optional(number) : std::nullopt;
}

}  // namespace

bool is_text(const std::map<std::string, std::string>& fields) {
  return std::all_of(fields.begin(), fields.end(), [](const auto& field) {
    return protocol::is_utf8(field.first) && protocol::is_utf8(field.second);
  });
}

std::optional<std::string> FieldReader::text(const std::string& name) const {
  const auto field = fields_.find(name);
  return field == fields_.end() || field->second.empty() ? std::nullopt
                                                         : std::optional(field->second);
}

std::optional<std::uint64_t> FieldReader::whole(const std::string& name) const {
  const auto field = text(name);
  if (!field) {
    return std::nullopt;
  }
  const auto number = read_as<std::uint64_t>(*field);
  if (!number) {
    throw std::invalid_argument(fmt::format("{} must be a whole number from 0", name));
  }
  return number;
}

std::optional<double> FieldReader::number(const std::string& name) const {
  const auto field = text(name);
  if (!field) {
    return std::nullopt;
  }
  const auto number = read_as<double>(*field);
  if (!number || !std::isfinite(*number)) {
    throw std::invalid_argument(fmt::format("{} must be a number", name));
  }
  return number;
}

std::uint64_t FieldReader::pixels(const std::string& name, std::uint64_t usual) const {
  const std::uint64_t pixels = whole(name).value_or(usual);
  if (pixels < 1 || pixels > kMostPixels) {
    throw std::invalid_argument(fmt::format("{} must be from 1 to {}", name, kMostPixels));
  }
  return pixels;
}

ColumnSource picture_column(const FieldReader& fields, const std::string& name,
                            bool may_be_category) {
  const std::string column = fields.text(name).value_or("");
  auto source = column_source(column);
  if (!source || (source->is_category && !may_be_category)) {
    throw std::invalid_argument(fmt::format("{} must be a column of numbers{}; \"{}\" is none",
                                            name, may_be_category ? " or categories" : "",
                                            protocol::excerpt(column)));
  }
  return *std::move(source);
}

}  // namespace oblique::server
