// Counters, gauges and histograms, and their text for Prometheus (exposition format 0.0.4). Values are counted from any
// thread without a lock; the text is a consistent set of names, each value is its newest.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gonio {

class Counter {
public:
    void add(std::uint64_t more = 1) { value_.fetch_add(more, std::memory_order_relaxed); }
    std::uint64_t value() const { return value_.load(std::memory_order_relaxed); }

private:
    std::atomic<std::uint64_t> value_{0};
};

class Gauge {
public:
    void set(double value) { value_.store(value, std::memory_order_relaxed); }
    double value() const { return value_.load(std::memory_order_relaxed); }

private:
    std::atomic<double> value_{0};
};

// Cumulative buckets of seconds.
class Histogram {
public:
    explicit Histogram(std::span<const double> bounds_s);
    void observe(double seconds);

    struct Bucket {
        double bound_s;       // the last: infinity
        std::uint64_t count;  // of values up to the bound
    };
    std::vector<Bucket> buckets() const;
    double sum_s() const { return static_cast<double>(sum_ns_.load(std::memory_order_relaxed)) * 1e-9; }

private:
    std::vector<double> bounds_s_;
    std::deque<std::atomic<std::uint64_t>> counts_;  // one more than bounds
    std::atomic<std::int64_t> sum_ns_{0};
};

// Half a millisecond to ten seconds: what frames, encodes and round trips take.
extern const std::span<const double> kLatencyBounds;

class Metrics {
public:
    Metrics() = default;
    Metrics(const Metrics&) = delete;
    Metrics& operator=(const Metrics&) = delete;

    // Result: the metric of this name and these labels, made when first asked for; it lives as long as this object.
    // The name is without the prefix "gonio_", with its unit ("encode_seconds", "frames_encoded_total"). The help is
    // one sentence. The labels are as they are printed, `reason="origin"`. Of one name all have the same kind, and at
    // most kMaxSeries labels are kept apart. What comes after that is counted under the label `other="true"`.
    Counter& counter(std::string_view name, std::string_view help, std::string_view labels = "");
    Gauge& gauge(std::string_view name, std::string_view help, std::string_view labels = "");
    Histogram& histogram(std::string_view name, std::string_view help, std::string_view labels = "",
                         std::span<const double> bounds_s = kLatencyBounds);
    // `refresh` is called before each text, to set gauges that nobody keeps up to date. It must not outlive what it
    // reads.
    void before_text(std::function<void()> refresh);

    std::string text() const;

    static constexpr std::size_t kMaxSeries = 64;

private:
    struct Series {
        Counter counter;
        Gauge gauge;
        std::deque<Histogram> histogram;  // none or one
    };
    enum class Kind : std::uint8_t { counter, gauge, histogram };
    struct Family {
        Kind kind;
        std::string help;
        std::map<std::string, Series, std::less<>> series;  // by labels
    };
    Series& series(std::string_view name, std::string_view help, std::string_view labels, Kind kind,
                   std::span<const double> bounds_s);

    mutable std::mutex mutex_;  // of the names, not of the values
    std::map<std::string, Family, std::less<>> families_;
    std::vector<std::function<void()>> refreshes_;
};

// Result: name="value", as Metrics takes labels; several are joined by commas. value: without quotes and backslashes.
std::string label(std::string_view name, std::string_view value);

// Memory, file descriptors, processor time and start of this process, under the names that Prometheus' clients use;
// read from /proc.
std::string process_metrics_text();

}  // namespace gonio
