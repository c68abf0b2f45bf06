#include "server/web/metric_text.h"

#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/server/web/prometheus_text.h"

namespace oblique::server {
namespace {

TEST(MetricText, IsWhatTheFormatSays) {
  MetricText out;
  out.family("points_total", MetricType::kCounter, "Points.\nAll \\ of \"them\".");
  out.sample(std::uint64_t{18'446'744'073'709'551'615U}, {{"state", "done"}});
  out.family("age_seconds", MetricType::kGauge, "Age.");
  out.sample(0.25);
  EXPECT_EQ(out.text(),
            "# HELP points_total Points.\\nAll \\\\ of \"them\".\n"
            "# TYPE points_total counter\n"
            "points_total{state=\"done\"} 18446744073709551615\n"
            "# HELP age_seconds Age.\n"
            "# TYPE age_seconds gauge\n"
            "age_seconds 0.25\n");
}

TEST(MetricText, CarriesAnyTextInLabels) {
  for (const std::string text : {"", "a\"b", "a\\b", "a\nb", "a\\nb", "\\", "\"", "{},= #", "μ é 💥",
                                 "tab\tend", "\\\\\"\n"}) {
    MetricText out;
    out.family("m", MetricType::kGauge, "M.");
    out.sample(1.0, {{"study", text}, {"state", "x"}});
    const auto metrics = parse_prometheus(out.text());
    EXPECT_EQ(metrics.at("m").samples.at(0).labels.at("study"), text);
  }
}

TEST(MetricText, WritesOutBytesThatAreNoText) {
  MetricText out;
  out.family("m", MetricType::kGauge, "M.");
  out.sample(1.0, {{"study", "a\xff"}});
  EXPECT_EQ(parse_prometheus(out.text()).at("m").samples.at(0).labels.at("study"), "a\\xff");
}

TEST(MetricText, HasNamesForNumbersThatAreNone) {
  MetricText out;
  out.family("m", MetricType::kGauge, "M.");
  out.sample(std::numeric_limits<double>::infinity(), {{"a", "1"}});
  out.sample(-std::numeric_limits<double>::infinity(), {{"a", "2"}});
  out.sample(std::numeric_limits<double>::quiet_NaN(), {{"a", "3"}});
  out.sample(1e300, {{"a", "4"}});
  EXPECT_NE(
      out.text().find("m{a=\"1\"} +Inf\nm{a=\"2\"} -Inf\nm{a=\"3\"} NaN\nm{a=\"4\"} 1e+300\n"),
      std::string::npos)
      << out.text();
}

TEST(MetricText, SumsTheBucketsOfAHistogramUp) {
  Histogram histogram({0.1, 1.0});
  for (const double amount : {0.05, 0.1, 0.5, 2.0, 3.0}) {
    histogram.observe(amount);
  }
  MetricText out;
  out.family("took_seconds", MetricType::kHistogram, "Took.");
  out.sample(histogram, {{"of", "x"}});
  EXPECT_EQ(out.text(),
            "# HELP took_seconds Took.\n"
            "# TYPE took_seconds histogram\n"
            "took_seconds_bucket{of=\"x\",le=\"0.1\"} 2\n"
            "took_seconds_bucket{of=\"x\",le=\"1\"} 3\n"
            "took_seconds_bucket{of=\"x\",le=\"+Inf\"} 5\n"
            "took_seconds_sum{of=\"x\"} 5.65\n"
            "took_seconds_count{of=\"x\"} 5\n");
  EXPECT_NO_THROW(parse_prometheus(out.text()));
}

TEST(MetricText, RefusesWhatPrometheusWould) {
  MetricText out;
  EXPECT_THROW(out.sample(1.0), std::logic_error);
  EXPECT_THROW(out.family("", MetricType::kGauge, ""), std::logic_error);
  EXPECT_THROW(out.family("1st", MetricType::kGauge, ""), std::logic_error);
  EXPECT_THROW(out.family("a-b", MetricType::kGauge, ""), std::logic_error);
  EXPECT_THROW(out.family("points", MetricType::kCounter, ""), std::logic_error);
  EXPECT_THROW(out.family("points_total", MetricType::kGauge, ""), std::logic_error);
  out.family("m", MetricType::kGauge, "M.");
  EXPECT_THROW(out.family("m", MetricType::kGauge, "M."), std::logic_error);
  EXPECT_THROW(out.sample(Histogram({1.0})), std::logic_error);
  EXPECT_THROW(out.sample(1.0, {{"a b", "x"}}), std::logic_error);
}

TEST(PrometheusText, TheParserOfTheTestsTakesNothingWrong) {
  const std::string head = "# HELP m M.\n# TYPE m gauge\n";
  for (const std::string text :
       {"m 1\n", "# TYPE m gauge\nm 1\n", "# HELP m M.\nm 1\n",
        "# HELP m M.\n# TYPE m counter\nm 1\n", "# HELP m M.\n# TYPE m gauge\nm 1",
        "# HELP m M.\n# TYPE m gauge\nm 1\nm 2\n", "# HELP m M.\n# TYPE m gauge\nm{a=\"1} 1\n",
        "# HELP m M.\n# TYPE m gauge\nm{a=\"\\x\"} 1\n", "# HELP m M.\n# TYPE m gauge\nm x\n",
        "# HELP m M.\n# TYPE m gauge\nn 1\n", "# HELP m M.\n# TYPE m gauge\nm  1\n",
        "# HELP m M.\n# TYPE m histogram\nm_sum 1\nm_count 1\n",
        "# HELP m M.\n# TYPE m histogram\nm_bucket{le=\"1\"} 2\nm_bucket{le=\"+Inf\"} 1\nm_sum 1\n"
        "m_count 1\n"}) {
    EXPECT_THROW(parse_prometheus(text), std::runtime_error) << text;
  }
  EXPECT_EQ(value_of(parse_prometheus(head + "m{a=\"1\"} 2\n"), "m", {{"a", "1"}}), 2.0);
}

}  // namespace
}  // namespace oblique::server
