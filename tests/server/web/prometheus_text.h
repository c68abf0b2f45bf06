#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace oblique::server {

/// One line of Prometheus' text format.
struct ParsedSample {
  std::string name;
  std::map<std::string, std::string> labels;
  double value;
};

struct ParsedMetric {
  std::string type;
  std::string help;
  std::vector<ParsedSample> samples;
};

/// Text of version 0.0.4, by name of the metric. Takes less than Prometheus does: HELP and TYPE
/// come first, samples of a metric stand together, nothing is there twice, and histograms are
/// whole. Throws std::runtime_error that has the line.
std::map<std::string, ParsedMetric> parse_prometheus(const std::string& text);

/// The value of the sample of that name, as of a bucket's, with these labels; throws
/// std::runtime_error when there is none.
double value_of(const std::map<std::string, ParsedMetric>& metrics, const std::string& name,
                const std::map<std::string, std::string>& labels = {});

}  // namespace oblique::server
