#include "server/base/metrics.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <thread>

#include "server/app/service.h"

namespace gonio {
namespace {

TEST(Metrics, TheTextIsWhatPrometheusReads) {
    Metrics metrics;
    metrics.counter("things_total", "Things.", "kind=\"a\"").add(3);
    metrics.counter("things_total", "Things.", "kind=\"b\"").add();
    metrics.gauge("level", "A level.").set(0.5);
    const double bounds[] = {0.01, 0.1};
    Histogram& histogram = metrics.histogram("wait_seconds", "Waits.", "", bounds);
    for (const double s : {0.005, 0.01, 0.05, 7.0, -1.0}) histogram.observe(s);
    EXPECT_EQ(metrics.text(),
              "# HELP gonio_level A level.\n# TYPE gonio_level gauge\ngonio_level 0.5\n"
              "# HELP gonio_things_total Things.\n# TYPE gonio_things_total counter\n"
              "gonio_things_total{kind=\"a\"} 3\ngonio_things_total{kind=\"b\"} 1\n"
              "# HELP gonio_wait_seconds Waits.\n# TYPE gonio_wait_seconds histogram\n"
              "gonio_wait_seconds_bucket{le=\"0.01\"} 2\ngonio_wait_seconds_bucket{le=\"0.1\"} 3\n"
              "gonio_wait_seconds_bucket{le=\"+Inf\"} 4\ngonio_wait_seconds_sum 7.065\ngonio_wait_seconds_count 4\n");
    EXPECT_EQ(&metrics.counter("things_total", "Things.", "kind=\"a\""),
              &metrics.counter("things_total", "", "kind=\"a\""));
}

TEST(Metrics, LabelsAreBounded) {
    Metrics metrics;
    for (std::size_t i = 0; i < Metrics::kMaxSeries + 10; ++i)
        metrics.counter("x_total", "X.", "n=\"" + std::to_string(i) + "\"").add();
    EXPECT_EQ(metrics.counter("x_total", "X.", "other=\"true\"").value(), 10u);
}

TEST(Metrics, GaugesAreRefreshedBeforeTheText) {
    Metrics metrics;
    int asked = 0;
    metrics.before_text([&] { metrics.gauge("asked", "Asked.").set(++asked); });
    EXPECT_NE(metrics.text().find("gonio_asked 1\n"), std::string::npos);
    EXPECT_NE(metrics.text().find("gonio_asked 2\n"), std::string::npos);
}

TEST(Metrics, CountsFromManyThreads) {
    Metrics metrics;
    Histogram& histogram = metrics.histogram("h_seconds", "H.");
    {
        std::vector<std::jthread> threads;
        for (int i = 0; i < 4; ++i)
            threads.emplace_back([&] {
                for (int k = 0; k < 1000; ++k) {
                    metrics.counter("c_total", "C.").add();
                    histogram.observe(0.003);
                    if (k % 100 == 0) metrics.text();
                }
            });
    }
    EXPECT_EQ(metrics.counter("c_total", "C.").value(), 4000u);
    EXPECT_EQ(histogram.buckets().back().count, 4000u);
    EXPECT_NEAR(histogram.sum_s(), 12.0, 1e-6);
}

TEST(Metrics, TheProcessTellsItsMemoryAndDescriptors) {
    const std::string text = process_metrics_text();
    for (const char* name : {"process_resident_memory_bytes ", "process_open_fds ", "process_cpu_seconds_total "})
        EXPECT_NE(text.find(std::string("\n") + name), std::string::npos) << text;
}

// A service manager on a socket of its own.
struct ServiceTest : testing::Test {
    std::string path = (std::filesystem::temp_directory_path() / ("gonio-notify-" + std::to_string(getpid()))).string();
    int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ServiceTest() {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
        EXPECT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
        const timeval time{1, 0};
        ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &time, sizeof time);
        setenv("NOTIFY_SOCKET", path.c_str(), 1);
    }
    ~ServiceTest() override {
        unsetenv("NOTIFY_SOCKET");
        unsetenv("WATCHDOG_USEC");
        ::close(fd);
        std::filesystem::remove(path);
    }
    std::string told() const {
        char text[256];
        const ssize_t n = ::recv(fd, text, sizeof text, 0);
        return n > 0 ? std::string(text, static_cast<std::size_t>(n)) : "";
    }
};

TEST_F(ServiceTest, StatesReachTheManager) {
    Service service;
    service.tell("READY=1");
    EXPECT_EQ(told(), "READY=1");
    service.watch([](std::function<void()> call) { call(); }, [] { return Service::Encoding{}; });
    EXPECT_EQ(told(), "") << "it asked for no sign of life";
}

TEST_F(ServiceTest, SignsOfLifeComeWhileRenderingNetworkAndEncodingAdvance) {
    setenv("WATCHDOG_USEC", "100000", 1);
    std::atomic<bool> renders{true}, answers{true}, encodes{true};
    std::atomic<std::uint64_t> given{1}, done{0};
    Service service;
    service.watch(
        [&](std::function<void()> call) {
            if (renders) service.render();
            if (answers) call();
        },
        [&] {
            if (encodes) ++given, ++done;
            return Service::Encoding{given, done};
        });
    EXPECT_EQ(told(), "WATCHDOG=1");
    EXPECT_EQ(told(), "WATCHDOG=1");
    for (std::atomic<bool>* const part : {&renders, &answers, &encodes}) {
        *part = false;
        while (!told().empty()) {  // a second without a sign
        }
        *part = true;
        EXPECT_EQ(told(), "WATCHDOG=1");
    }
    encodes = false;
    while (!told().empty()) {
    }
    done = given.load();
    EXPECT_EQ(told(), "WATCHDOG=1") << "nothing is left to encode";
}

}  // namespace
}  // namespace gonio
