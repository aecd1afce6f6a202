#include "tests/soak/metrics_text.h"

#include <gtest/gtest.h>

namespace gonio::soak {
namespace {

TEST(MetricsText, WhatPrometheusDoesNotReadIsNamed) {
    const std::string head = "# HELP a_total Of a.\n# TYPE a_total counter\n";
    const std::string good = head +
                             "a_total{x=\"y\",z=\"\"} 1\na_total 2.5e+06\n# HELP h_seconds H.\n# TYPE h_seconds "
                             "histogram\nh_seconds_bucket{le=\"+Inf\"} 3\nh_seconds_sum 0.5\nh_seconds_count 3\n";
    EXPECT_EQ(metrics_fault(good), "");
    EXPECT_EQ(metric_value(good, "a_total"), 2.5e6);
    EXPECT_EQ(metric_value(good, "a_total{x=\"y\",z=\"\"}"), 1);
    EXPECT_EQ(metric_value(good, "total"), -1);
    for (const std::string& bad :
         {std::string(), head, head + "a_total 1", head + "a-total 1\n", head + "a_total one\n", head + "b_total 1\n",
          head + "a_total 1\na_total 2\n", head + "a_total{x=y} 1\n", head + "a_total{x=\"y\" 1\n", head + head,
          head + "a_total_sum 1\n", head + "\na_total 1\n", std::string("# TYPE a_total counter\na_total 1\n")})
        EXPECT_NE(metrics_fault(bad), "") << bad;
}

}  // namespace
}  // namespace gonio::soak
