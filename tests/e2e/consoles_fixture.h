// goniod listening to consoles on free ports of the loopback interface, and what tests ask it.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include "protocol/osc/osc.h"
#include "tests/console/udp.h"
#include "tests/e2e/daemon_process.h"

namespace gonio::test {

using Json = nlohmann::json;
using namespace std::chrono_literals;

inline Packet osc(const std::string& address, std::vector<OscArgument> arguments = {}) {
    return encode_osc({kOscImmediately, address, std::move(arguments)});
}

class Consoles : public testing::Test {
protected:
    void SetUp() override { start({}); }
    void start(std::vector<std::string> more, const std::string& sacn_at = "127.0.0.1:0") {
        std::vector<std::string> arguments = {"--size",   "160x160",     "--sacn", sacn_at,
                                              "--artnet", "127.0.0.1:0", "--osc",  "127.0.0.1:0"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        daemon.reset();
        daemon = std::make_unique<DaemonProcess>(arguments);
        light = daemon->json({"get", "lights[0].name"});
        const Json table = daemon->json({"sources"});
        for (const Json& endpoint : table["endpoints"]) {
            const std::string address = endpoint["address"];
            ports[endpoint["protocol"]] = static_cast<std::uint16_t>(std::stoi(address.substr(address.find(':') + 1)));
        }
    }
    // Calls `often` every 25 ms until `done` or for so long. Result: whether it was done.
    bool until(
        const std::function<bool()>& done, const std::function<void()>& often = [] {},
        std::chrono::milliseconds time = 10s) {
        const auto end = std::chrono::steady_clock::now() + time;
        auto look = std::chrono::steady_clock::now();
        while (std::chrono::steady_clock::now() < end) {
            often();
            if (std::chrono::steady_clock::now() >= look) {
                if (done()) return true;
                look = std::chrono::steady_clock::now() + 150ms;
            }
            std::this_thread::sleep_for(25ms);
        }
        return false;
    }
    double level() { return daemon->json({"get", "lights[0].level_ratio"}); }
    bool level_is(double wanted) { return std::abs(level() - wanted) < 1e-9; }
    // The first picture, with every bounce of its light: what later frames do not begin anew.
    void first_picture() {
        ASSERT_TRUE(daemon->transport_ready());
        daemon->json({"report"});
    }
    // The frame that shows the newest change ran the composite, and where it is a pass of its own NV12, only.
    void expect_composite_only() {
        const unsigned rev = daemon->json({"get", "scene_rev"});
        std::set<std::string> names = passes_ran(daemon->json({"report", "--rev", std::to_string(rev)}));
        names.erase("nv12");
        names.erase("refine");  // of the same light, in time that nobody asked for
        EXPECT_EQ(names, (std::set<std::string>{"composite"}));
    }
    Json source(const std::string& protocol) {
        const Json table = daemon->json({"sources"});
        for (const Json& row : table["sources"])
            if (row["protocol"] == protocol) return row;
        return {};
    }
    Json endpoint(const std::string& protocol) {
        const Json table = daemon->json({"sources"});
        for (const Json& row : table["endpoints"])
            if (row["protocol"] == protocol) return row;
        return {};
    }
    SacnPacket sacn(std::uint8_t cid, std::uint8_t value, std::uint8_t priority = 100) {
        SacnPacket packet;
        packet.cid = cid;
        packet.name = "desk " + std::to_string(cid);
        packet.priority = priority;
        packet.sequence = sequence[cid]++;
        packet.slots.assign(512, 0);
        packet.slots[0] = value;
        return packet;
    }
    std::unique_ptr<DaemonProcess> daemon;
    std::map<std::string, std::uint16_t> ports;
    std::map<int, std::uint8_t> sequence;
    std::string light;
};

// The stream of pictures as a browser takes it: counts them.
class Viewer {
public:
    explicit Viewer(const std::string& url) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        sockaddr_in at{};
        at.sin_family = AF_INET;
        at.sin_port = htons(port_of(url));
        at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        const std::string request = "GET /v1/mjpeg HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
        if (connect(fd_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 ||
            write(fd_, request.data(), request.size()) != static_cast<ssize_t>(request.size()))
            throw std::runtime_error("no stream");
        thread_ = std::thread([this] {
            const std::string boundary = "--gonio-frame";
            std::string text, buffer(65536, 0);
            for (ssize_t size = 0; (size = read(fd_, buffer.data(), buffer.size())) > 0;) {
                text.append(buffer, 0, static_cast<std::size_t>(size));
                std::size_t done = 0;
                for (std::size_t found = 0; (found = text.find(boundary, done)) != std::string::npos;) {
                    done = found + boundary.size();
                    ++boundaries_;
                }
                text.erase(0, std::max(done, text.size() - std::min(text.size(), boundary.size() - 1)));
            }
        });
    }
    ~Viewer() {
        shutdown(fd_, SHUT_RDWR);
        thread_.join();
        close(fd_);
    }
    int pictures() const { return std::max(0, boundaries_.load() - 1); }

private:
    int fd_;
    std::atomic<int> boundaries_{0};  // the first stands before the first picture
    std::thread thread_;
};

}  // namespace gonio::test
