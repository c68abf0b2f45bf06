#include "server/web/metric_text.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

constexpr std::string_view kTotal = "_total";

/// Prometheus also takes colons in names of metrics, which are meant for its own rules.
bool is_name(std::string_view name) {
  const auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  };
  const auto is_allowed = [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); };
  return !name.empty() && is_letter(name.front()) &&
         std::all_of(name.begin(), name.end(), is_allowed);
}

std::string metric_number(double value) {
  if (std::isnan(value)) {
    return "NaN";
  }
  if (std::isinf(value)) {
    return value > 0.0 ? "+Inf" : "-Inf";
  }
  return solver::exact_number(value);
}

/// Quotes are escaped in values of labels, not in help.
std::string escaped(std::string_view text, bool with_quotes) {
  std::string result;
  for (const char c : text) {
    if (c == '\n') {
      result += "\\n";
    } else if (c == '\\' || (c == '"' && with_quotes)) {
      result += {'\\', c};
    } else {
      result += c;
    }
  }
  return result;
}

std::string_view type_name(MetricType type) {
  switch (type) {
    case MetricType::kCounter:
      return "counter";
    case MetricType::kGauge:
      return "gauge";
    case MetricType::kHistogram:
      return "histogram";
  }
  return {};
}

}  // namespace

void MetricText::family(std::string_view name, MetricType type, std::string_view help) {
  const bool ends_in_total = name.ends_with(kTotal);
  if (!is_name(name) || ends_in_total != (type == MetricType::kCounter)) {
    throw std::logic_error(fmt::format("{} is no name of a {}", name, type_name(type)));
  }
  if (!names_.emplace(name).second) {
    throw std::logic_error(fmt::format("the metric {} is written twice", name));
  }
  name_ = name;
  type_ = type;
  text_ += fmt::format("# HELP {} {}\n# TYPE {} {}\n", name, escaped(help, false), name,
                       type_name(type));
}

void MetricText::sample(double value, const Labels& labels) {
  expect(false);
  line({}, labels, metric_number(value));
}

void MetricText::sample(std::uint64_t value, const Labels& labels) {
  expect(false);
  line({}, labels, std::to_string(value));
}

void MetricText::sample(const Histogram& histogram, const Labels& labels) {
  expect(true);
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < histogram.counts().size(); ++i) {
    count += histogram.counts()[i];
    const std::string bound =
        i < histogram.bounds().size() ? metric_number(histogram.bounds()[i]) : "+Inf";
    Labels all = labels;
    all.push_back({"le", bound});
    line("_bucket", all, std::to_string(count));
  }
  line("_sum", labels, metric_number(histogram.sum()));
  line("_count", labels, std::to_string(count));
}

void MetricText::expect(bool is_histogram) const {
  if (name_.empty() || is_histogram != (type_ == MetricType::kHistogram)) {
    throw std::logic_error(fmt::format("{} has no samples of that kind", name_));
  }
}

void MetricText::line(std::string_view suffix, const Labels& labels, std::string_view value) {
  text_ += name_;
  text_ += suffix;
  char before = '{';
  for (const MetricLabel& label : labels) {
    if (!is_name(label.name)) {
      throw std::logic_error(fmt::format("{} is no name of a label", label.name));
    }
    const std::string plain =
        protocol::is_utf8(label.value) ? std::string(label.value) : protocol::visible(label.value);
    text_ += fmt::format("{}{}=\"{}\"", before, label.name, escaped(plain, true));
    before = ',';
  }
  text_ += labels.empty() ? "" : "}";
  text_ += fmt::format(" {}\n", value);
}

}  // namespace oblique::server
