#include "tests/server/web/prometheus_text.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

[[noreturn]] void complain(const std::string& what, const std::string& line) {
  throw std::runtime_error(what + ": " + line);
}

/// What is read of a line, from left to right.
class Cursor {
 public:
  explicit Cursor(const std::string& line) : line_(line) {}

  std::string name() {
    const std::size_t begin = at_;
    while (at_ < line_.size() &&
           (std::isalnum(static_cast<unsigned char>(line_[at_])) != 0 || line_[at_] == '_')) {
      ++at_;
    }
    if (begin == at_ || std::isdigit(static_cast<unsigned char>(line_[begin])) != 0) {
      complain("a name is missing", line_);
    }
    return line_.substr(begin, at_ - begin);
  }
  bool takes(char c) {
    const bool is_there = at_ < line_.size() && line_[at_] == c;
    at_ += is_there ? 1 : 0;
    return is_there;
  }
  void expect(char c) {
    if (!takes(c)) {
      complain(std::string("there is no ") + c, line_);
    }
  }
  std::string quoted() {
    expect('"');
    std::string text;
    while (!takes('"')) {
      if (at_ == line_.size()) {
        complain("a quote is missing", line_);
      }
      if (takes('\\')) {
        text += takes('n') ? '\n' : takes('"') ? '"' : (expect('\\'), '\\');
      } else {
        text += line_[at_++];
      }
    }
    return text;
  }
  double number_to_the_end() {
    const std::string text = line_.substr(at_);
    const std::map<std::string, double> others{{"+Inf", std::numeric_limits<double>::infinity()},
                                               {"-Inf", -std::numeric_limits<double>::infinity()},
                                               {"NaN", std::numeric_limits<double>::quiet_NaN()}};
    if (const auto other = others.find(text); other != others.end()) {
      return other->second;
    }
    const auto number = solver::number_of(text);
    if (!number || !std::isfinite(*number)) {
      complain("no number", line_);
    }
    return *number;
  }

 private:
  const std::string& line_;
  std::size_t at_ = 0;
};

ParsedSample sample_of(const std::string& line) {
  Cursor cursor(line);
  ParsedSample sample{cursor.name(), {}, 0.0};
  if (cursor.takes('{')) {
    do {
      const std::string label = cursor.name();
      cursor.expect('=');
      if (!sample.labels.emplace(label, cursor.quoted()).second) {
        complain("a label is there twice", line);
      }
    } while (cursor.takes(','));
    cursor.expect('}');
  }
  cursor.expect(' ');
  sample.value = cursor.number_to_the_end();
  return sample;
}

void check_histogram(const std::string& name, const ParsedMetric& metric) {
  double count = 0.0;
  double bound = -std::numeric_limits<double>::infinity();
  std::set<std::string> kinds;
  for (const ParsedSample& sample : metric.samples) {
    kinds.insert(sample.name);
    if (sample.name == name + "_bucket") {
      const std::string& text = sample.labels.at("le");
      const double next = text == "+Inf" ? std::numeric_limits<double>::infinity()
                                         : solver::number_of(text).value();
      if (next <= bound || sample.value < count) {
        complain("buckets do not ascend", name);
      }
      bound = next;
      count = sample.value;
    } else if (sample.name == name + "_count" && (std::isfinite(bound) || sample.value != count)) {
      complain("the last bucket is not all", name);
    }
  }
  if (kinds != std::set<std::string>{name + "_bucket", name + "_sum", name + "_count"}) {
    complain("the histogram is not whole", name);
  }
}

void check(const std::string& name, const ParsedMetric& metric) {
  std::set<std::pair<std::string, std::map<std::string, std::string>>> seen;
  for (const ParsedSample& sample : metric.samples) {
    if (!seen.emplace(sample.name, sample.labels).second) {
      complain("a sample is there twice", name);
    }
  }
  if (metric.type == "histogram") {
    check_histogram(name, metric);
  } else if ((metric.type == "counter") != name.ends_with("_total")) {
    complain("counters, and no other, end in _total", name);
  } else if (metric.type != "counter" && metric.type != "gauge") {
    complain("no type", metric.type);
  }
}

}  // namespace

std::map<std::string, ParsedMetric> parse_prometheus(const std::string& text) {
  if (!text.ends_with('\n')) {
    complain("the last line has no end", text);
  }
  std::map<std::string, ParsedMetric> metrics;
  std::string current;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string hash;
    std::string key;
    std::string name;
    words >> hash >> key >> name;
    if (hash != "#") {
      const ParsedSample sample = sample_of(line);
      if (!sample.name.starts_with(current) || metrics[current].type.empty()) {
        complain("a sample of no metric", line);
      }
      const bool is_part = metrics[current].type == "histogram";
      if (!is_part && sample.name != current) {
        complain("a sample of another metric", line);
      }
      metrics[current].samples.push_back(sample);
      continue;
    }
    std::string rest;
    std::getline(words >> std::ws, rest);
    if (key == "HELP" && metrics.try_emplace(name, ParsedMetric{{}, rest, {}}).second) {
      current = name;
    } else if (key == "TYPE" && name == current && metrics[name].type.empty()) {
      metrics[name].type = rest;
    } else {
      complain("a comment out of place", line);
    }
  }
  for (const auto& [name, metric] : metrics) {
    check(name, metric);
  }
  return metrics;
}

double value_of(const std::map<std::string, ParsedMetric>& metrics, const std::string& name,
                const std::map<std::string, std::string>& labels) {
  for (const auto& [metric, parsed] : metrics) {
    for (const ParsedSample& sample : parsed.samples) {
      if (sample.name == name && sample.labels == labels) {
        return sample.value;
      }
    }
  }
  throw std::runtime_error("there is no sample of " + name);
}

}  // namespace oblique::server
