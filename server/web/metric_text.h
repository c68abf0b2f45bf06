#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/study/histogram.h"

namespace oblique::server {

enum class MetricType { kCounter, kGauge, kHistogram };

struct MetricLabel {
  std::string_view name;
  std::string_view value;  ///< any text; bytes that are not UTF-8 are written out
};

/// Writes metrics in Prometheus' text format, version 0.0.4. Names are ours: a wrong one throws
/// std::logic_error, as does a sample without a family of its type.
class MetricText {
 public:
  using Labels = std::vector<MetricLabel>;

  /// The samples that follow are of this metric. Each is written once. The name of a counter ends
  /// in _total, that of no other does.
  void family(std::string_view name, MetricType type, std::string_view help);
  /// Of a counter or a gauge.
  void sample(double value, const Labels& labels = {});
  void sample(std::uint64_t value, const Labels& labels = {});
  /// Of a histogram: its buckets, the infinite one too, sum and count.
  void sample(const Histogram& histogram, const Labels& labels = {});

  const std::string& text() const { return text_; }
  static constexpr const char* kContentType = "text/plain; version=0.0.4; charset=utf-8";

 private:
  void expect(bool is_histogram) const;
  void line(std::string_view suffix, const Labels& labels, std::string_view value);

  std::string text_;
  std::string name_;
  MetricType type_ = MetricType::kGauge;
  std::set<std::string, std::less<>> names_;
};

}  // namespace oblique::server
