#include "server/base/metrics.h"

#include <dirent.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>

#include "ies/core/number_text.h"

namespace gonio {
namespace {

constexpr std::array<double, 14> kBounds = {0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.033,
                                            0.066,  0.125, 0.25,  0.5,   1,     2.5,   10};

std::string number(double value) {
    if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
    if (std::isnan(value)) return "NaN";
    return number_text(value);
}

void add_line(std::string& text, std::string_view name, std::string_view labels, const std::string& value) {
    text.append("gonio_").append(name);
    if (!labels.empty()) text.append("{").append(labels).append("}");
    text.append(" ").append(value).append("\n");
}

std::string with_bound(std::string_view labels, double bound_s) {
    return std::string(labels) + (labels.empty() ? "" : ",") + label("le", number(bound_s));
}

void add_head(std::string& text, const std::string& name, const char* kind, const std::string& help) {
    text += "# HELP " + name + " " + help + "\n# TYPE " + name + " " + kind + "\n";
}

void add_plain(std::string& text, const std::string& name, const char* kind, const char* help, double value) {
    add_head(text, name, kind, help);
    text += name + " " + number(value) + "\n";
}

double open_descriptors() {
    DIR* folder = opendir("/proc/self/fd");
    if (folder == nullptr) return 0;
    double count = -3;  // itself, "." and ".."
    while (readdir(folder) != nullptr) ++count;
    closedir(folder);
    return count;
}

}  // namespace

const std::span<const double> kLatencyBounds = kBounds;

Histogram::Histogram(std::span<const double> bounds_s) : bounds_s_(bounds_s.begin(), bounds_s.end()) {
    for (std::size_t i = 0; i <= bounds_s_.size(); ++i) counts_.emplace_back(0);
}

void Histogram::observe(double seconds) {
    if (!(seconds >= 0)) return;
    std::size_t at = 0;
    while (at < bounds_s_.size() && seconds > bounds_s_[at]) ++at;
    counts_[at].fetch_add(1, std::memory_order_relaxed);
    sum_ns_.fetch_add(std::llround(std::min(seconds, 1e6) * 1e9), std::memory_order_relaxed);
}

std::vector<Histogram::Bucket> Histogram::buckets() const {
    std::vector<Bucket> result;
    std::uint64_t count = 0;
    for (std::size_t i = 0; i <= bounds_s_.size(); ++i) {
        count += counts_[i].load(std::memory_order_relaxed);
        result.push_back({i < bounds_s_.size() ? bounds_s_[i] : std::numeric_limits<double>::infinity(), count});
    }
    return result;
}

Metrics::Series& Metrics::series(std::string_view name, std::string_view help, std::string_view labels, Kind kind,
                                 std::span<const double> bounds_s) {
    std::lock_guard lock(mutex_);
    auto family = families_.find(name);
    if (family == families_.end())
        family = families_.emplace(std::string(name), Family{kind, std::string(help), {}}).first;
    auto& all = family->second.series;
    auto found = all.find(labels);
    if (found == all.end() && all.size() >= kMaxSeries) found = all.find(labels = "other=\"true\"");
    if (found != all.end()) return found->second;
    Series& made = all[std::string(labels)];
    if (kind == Kind::histogram) made.histogram.emplace_back(bounds_s);
    return made;
}

Counter& Metrics::counter(std::string_view name, std::string_view help, std::string_view labels) {
    return series(name, help, labels, Kind::counter, {}).counter;
}

Gauge& Metrics::gauge(std::string_view name, std::string_view help, std::string_view labels) {
    return series(name, help, labels, Kind::gauge, {}).gauge;
}

Histogram& Metrics::histogram(std::string_view name, std::string_view help, std::string_view labels,
                              std::span<const double> bounds_s) {
    return series(name, help, labels, Kind::histogram, bounds_s).histogram.front();
}

void Metrics::before_text(std::function<void()> refresh) {
    std::lock_guard lock(mutex_);
    refreshes_.push_back(std::move(refresh));
}

std::string Metrics::text() const {
    std::vector<std::function<void()>> refreshes;
    {
        std::lock_guard lock(mutex_);
        refreshes = refreshes_;
    }
    for (const auto& refresh : refreshes) refresh();
    constexpr const char* kinds[] = {"counter", "gauge", "histogram"};
    std::lock_guard lock(mutex_);
    std::string text;
    for (const auto& [name, family] : families_) {
        add_head(text, "gonio_" + name, kinds[static_cast<int>(family.kind)], family.help);
        for (const auto& [labels, one] : family.series) {
            if (family.kind == Kind::counter) add_line(text, name, labels, std::to_string(one.counter.value()));
            if (family.kind == Kind::gauge) add_line(text, name, labels, number(one.gauge.value()));
            if (family.kind != Kind::histogram) continue;
            const Histogram& histogram = one.histogram.front();
            const auto buckets = histogram.buckets();
            for (const Histogram::Bucket& bucket : buckets)
                add_line(text, name + "_bucket", with_bound(labels, bucket.bound_s), std::to_string(bucket.count));
            add_line(text, name + "_sum", labels, number(histogram.sum_s()));
            add_line(text, name + "_count", labels, std::to_string(buckets.back().count));
        }
    }
    return text;
}

std::string label(std::string_view name, std::string_view value) {
    return std::string(name) + "=\"" + std::string(value) + "\"";
}

std::string process_metrics_text() {
    std::string text;
    std::ifstream statm("/proc/self/statm");
    double size_pages = 0, resident_pages = 0;
    statm >> size_pages >> resident_pages;
    const auto page_bytes = static_cast<double>(sysconf(_SC_PAGESIZE));
    add_plain(text, "process_resident_memory_bytes", "gauge", "Memory in use.", resident_pages * page_bytes);
    add_plain(text, "process_virtual_memory_bytes", "gauge", "Address space in use.", size_pages * page_bytes);
    add_plain(text, "process_open_fds", "gauge", "Open file descriptors.", open_descriptors());
    rlimit descriptors{};
    if (getrlimit(RLIMIT_NOFILE, &descriptors) == 0)
        add_plain(text, "process_max_fds", "gauge", "Most open file descriptors.",
                  static_cast<double>(descriptors.rlim_cur));
    rusage usage{};
    if (getrusage(RUSAGE_SELF, &usage) == 0) {
        const auto seconds = [](const timeval& time) {
            return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
        };
        add_plain(text, "process_cpu_seconds_total", "counter", "Processor time, user and system.",
                  seconds(usage.ru_utime) + seconds(usage.ru_stime));
    }
    return text;
}

}  // namespace gonio
