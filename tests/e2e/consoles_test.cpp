// Consoles as the network brings them: packets to the real goniod, levels in the scene, frames of the composite alone.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>
#include <set>
#include <thread>

#include "protocol/osc.h"
#include "tests/console/udp.h"
#include "tests/e2e/daemon_process.h"

namespace gonio::test {
namespace {

using Json = nlohmann::json;
using namespace std::chrono_literals;

std::set<std::string> ran(const Json& report) {
    std::set<std::string> names;
    for (const Json& pass : report["passes"])
        if (pass["state"] == "ran") names.insert(pass["name"]);
    return names;
}

Packet osc(const std::string& address, std::vector<OscArgument> arguments = {}) {
    return encode_osc({kOscImmediately, address, std::move(arguments)});
}

class Consoles : public testing::Test {
protected:
    void SetUp() override { start({}); }
    void start(std::vector<std::string> more) {
        std::vector<std::string> arguments = {"--size",   "160x160",     "--sacn", "127.0.0.1:0",
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
    // The frame that shows the newest change ran the composite, and where it is a pass of its own NV12, only.
    void expect_composite_only() {
        const unsigned rev = daemon->json({"get", "scene_rev"});
        std::set<std::string> names = ran(daemon->json({"report", "--rev", std::to_string(rev)}));
        names.erase("nv12");
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

TEST_F(Consoles, SacnByMulticastIsALevelAndAFrameOfTheCompositeAlone) {
    Udp desk;
    const auto send = [&](std::uint8_t value) { desk.send("239.255.0.1", ports["sacn"], sacn(1, value).bytes()); };
    daemon->json({"report"});  // the first picture is there
    ASSERT_TRUE(until([&] { return level_is(51 / 255.0); }, [&] { send(51); }));
    expect_composite_only();
    ASSERT_TRUE(until([&] { return source("sacn")["state"] == "live"; }, [&] { send(51); }));
    const Json row = source("sacn");
    EXPECT_EQ(row["universe"], 1);
    EXPECT_EQ(row["name"], "desk 1");
    EXPECT_EQ(row["state"], "live");
    EXPECT_EQ(row["levels"], Json({51}));
    EXPECT_EQ(row["out_of_order"], 0) << "one socket hears a packet once";
    EXPECT_EQ(row["winning_slots"], 512);
    EXPECT_EQ(daemon->json({"stats"})["sources"]["sources"].size(), 1u);
    const Finished table = daemon->gonio({"sources"});
    EXPECT_NE(table.out.find("desk 1"), std::string::npos) << table.out;
    // What another hand sets stays while the console repeats itself.
    daemon->rev({"set", "light", light, "--level", "0.75"});
    for (int i = 0; i < 20; ++i) send(51), std::this_thread::sleep_for(25ms);
    EXPECT_TRUE(level_is(0.75));
    EXPECT_TRUE(until([&] { return level_is(52 / 255.0); }, [&] { send(52); }));
}

TEST_F(Consoles, PriorityTerminationAndLossDecideWhoWins) {
    Udp desk, backup;
    bool desk_sends = true;
    const auto both = [&] {
        if (desk_sends) desk.send("127.0.0.1", ports["sacn"], sacn(1, 200, 100).bytes());
        backup.send("127.0.0.1", ports["sacn"], sacn(2, 10, 150).bytes());
    };
    ASSERT_TRUE(until([&] { return level_is(10 / 255.0); }, both)) << level();
    // The higher one terminates, without slots: the lower one is heard at once.
    SacnPacket end = sacn(2, 0, 150);
    end.slots.clear();
    end.options = 0x40;
    backup.send("127.0.0.1", ports["sacn"], end.bytes());
    EXPECT_TRUE(until([&] { return level_is(200 / 255.0); },
                      [&] { desk.send("127.0.0.1", ports["sacn"], sacn(1, 200).bytes()); }, 1500ms));
    EXPECT_TRUE(until([&] { return source("sacn")["state"] == "lost"; }));
    EXPECT_TRUE(level_is(200 / 255.0)) << "the last look stays";
}

TEST_F(Consoles, ArtnetIsALevelAndPollsAreAnswered) {
    Udp desk;
    std::uint8_t number = 0;
    const auto send = [&] {
        desk.send("127.0.0.1", ports["artnet"],
                  art_dmx(number = static_cast<std::uint8_t>(number % 255 + 1), 0, {102, 0}));
    };
    daemon->json({"report"});
    ASSERT_TRUE(until([&] { return level_is(0.4); }, send));
    expect_composite_only();
    EXPECT_TRUE(until([&] { return source("artnet")["universe"] == 0; }, send));
    desk.send("127.0.0.1", ports["artnet"], art_header(0x2000, 14));
    const auto reply = desk.receive(3s);
    ASSERT_TRUE(reply);
    ASSERT_EQ(reply->size(), 239u);
    EXPECT_EQ((*reply)[9], 0x21);
    EXPECT_EQ((*reply)[200], 0x06);
    EXPECT_EQ((*reply)[173], 1) << "the default patch listens to one port-address";
    // A second sender merges, a third is refused and counted.
    Udp second("127.0.0.2"), third("127.0.0.3");
    second.send("127.0.0.1", ports["artnet"], art_dmx(0, 0, {204, 0}));
    EXPECT_TRUE(until([&] { return level_is(0.8); }, send)) << "the highest of two";
    third.send("127.0.0.1", ports["artnet"], art_dmx(0, 0, {255, 0}));
    EXPECT_TRUE(until([&] { return endpoint("artnet")["refused_sources"] == 1; }));
    EXPECT_TRUE(level_is(0.8));
}

TEST_F(Consoles, OscSetsAsksAndTellsItsSubscribers) {
    Udp panel, watcher;
    const auto send = [&](const Udp& from, const Packet& packet) { from.send("127.0.0.1", ports["osc"], packet); };
    const auto hear = [&](const Udp& at, const std::string& address) -> std::optional<OscMessage> {
        while (const auto packet = at.receive(3s)) {
            const auto messages = decode_osc(*packet);
            if (!messages) continue;
            for (const OscMessage& message : *messages)
                if (message.address == address) return message;
        }
        return std::nullopt;
    };
    const std::string root = "/light/" + encode_osc_name(light);
    daemon->json({"report"});
    send(panel, osc(root + "/level", {0.25F}));
    ASSERT_TRUE(until([&] { return level_is(0.25); }));
    expect_composite_only();
    send(panel, osc("/light/*/level", {0.5}));
    EXPECT_TRUE(until([&] { return level_is(0.5); }));
    // A query.
    send(panel, osc(root + "/level"));
    const auto answer = hear(panel, root + "/level");
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->arguments, (std::vector<OscArgument>{0.5F}));
    // A subscriber hears everything once, then changes, whoever made them.
    send(watcher, osc("/gonio/subscribe"));
    const auto first = hear(watcher, "/master");
    ASSERT_TRUE(first);
    daemon->rev({"set", "light", light, "--level", "0.125"});
    const auto told = hear(watcher, root + "/level");
    ASSERT_TRUE(told);
    EXPECT_EQ(told->arguments, (std::vector<OscArgument>{0.125F}));
    // and why something was refused.
    send(watcher, osc(root + "/level", {7.0F}));
    const auto refusal = hear(watcher, "/gonio/error");
    ASSERT_TRUE(refusal);
    EXPECT_EQ(refusal->arguments.at(0), OscArgument("invalid_argument"));
    EXPECT_EQ(refusal->arguments.at(1), OscArgument(root + "/level"));
    send(watcher, osc("/light/nobody/level", {0.5F}));
    EXPECT_EQ(hear(watcher, "/gonio/error")->arguments.at(0), OscArgument("not_found"));
    EXPECT_TRUE(level_is(0.125));
    // Another port for the feedback, as tablets want it.
    Udp listening;
    send(panel, osc("/gonio/subscribe", {static_cast<std::int32_t>(listening.port())}));
    EXPECT_TRUE(hear(listening, root + "/position"));
    EXPECT_TRUE(until([&] { return endpoint("osc")["packets"] == 7; })) << endpoint("osc");
    EXPECT_EQ(source("osc")["protocol"], "osc");
    send(panel, Packet{1, 2, 3});
    EXPECT_TRUE(until([&] { return endpoint("osc")["bad_packets"] == 1; }));
}

TEST_F(Consoles, AnOscBundleComesWhenItIsDueAndOscOverTcpAnswers) {
    Udp panel;
    const std::string root = "/light/" + encode_osc_name(light);
    // A bundle for 800 ms from now.
    Packet bundle =
        encode_osc_bundle({{kOscImmediately, root + "/level", {0.375F}}, {kOscImmediately, "/exposure", {3.0F}}});
    const auto due = std::chrono::system_clock::now().time_since_epoch() + 800ms;
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(due).count();
    const double fraction = std::chrono::duration<double>(due - std::chrono::seconds(seconds)).count();
    const std::uint64_t tag = (static_cast<std::uint64_t>(seconds + 2'208'988'800) << 32) |
                              static_cast<std::uint64_t>(fraction * 4294967296.0);
    for (std::size_t i = 0; i < 8; ++i) bundle[8 + i] = static_cast<std::uint8_t>(tag >> (56 - 8 * i));
    const auto sent = std::chrono::steady_clock::now();
    panel.send("127.0.0.1", ports["osc"], bundle);
    std::this_thread::sleep_for(300ms);
    EXPECT_FALSE(level_is(0.375)) << "too early";
    ASSERT_TRUE(until([&] { return level_is(0.375); }));
    EXPECT_GE(std::chrono::steady_clock::now() - sent, 750ms);
    EXPECT_EQ(daemon->json({"get", "exposure_ev100"}), 3.0);

    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(ports["osc"]);
    inet_pton(AF_INET, "127.0.0.1", &at.sin_addr);
    ASSERT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    Packet stream;
    for (const Packet& packet : {osc(root + "/level", {0.625F}), osc("/gonio/ping", {7})}) {
        stream.resize(stream.size() + 4);
        stream[stream.size() - 1] = static_cast<std::uint8_t>(packet.size());
        stream.insert(stream.end(), packet.begin(), packet.end());
    }
    ASSERT_EQ(write(fd, stream.data(), stream.size()), static_cast<ssize_t>(stream.size()));
    Packet reply(256);
    const ssize_t size = read(fd, reply.data(), reply.size());
    ASSERT_GT(size, 4);
    const auto pong = decode_osc(Bytes(reply).subspan(4, static_cast<std::size_t>(size - 4)));
    ASSERT_TRUE(pong);
    EXPECT_EQ((*pong)[0].address, "/gonio/pong");
    EXPECT_EQ((*pong)[0].arguments, (std::vector<OscArgument>{7}));
    EXPECT_TRUE(until([&] { return level_is(0.625); }));
    close(fd);
}

TEST_F(Consoles, ThePatchComesFromAFileAndIsChangedLive) {
    TemporaryFolder folder;
    const std::string file =
        folder.file("patch.toml", "[[patch]]\nsacn = 7\naddress = 3\ntarget = \"" + light +
                                      "\"\nchannels = [\"level:16\", \"pan:16\", \"color\"]\nrange.pan = [-90, 90]\n"
                                      "[[patch]]\nsacn = 7\naddress = 1\nchannels = [\"master\"]\n");
    start({"--patch", file});
    EXPECT_EQ(daemon->json({"patch"})["rows"].size(), 4u);
    EXPECT_TRUE(until([&] { return endpoint("sacn")["universes"] == Json({7}); }));
    Udp desk;
    SacnPacket packet = sacn(1, 128);
    packet.universe = 7;
    const std::uint8_t slots[] = {128, 0, 0x40, 0x00, 0xFF, 0xFF, 255, 0, 51};
    std::copy(std::begin(slots), std::end(slots), packet.slots.begin());
    const auto send = [&](unsigned universe) {
        packet.universe = universe;
        packet.sequence = sequence[100 + static_cast<int>(universe)]++;
        desk.send("239.255.0." + std::to_string(universe), ports["sacn"], packet.bytes());
    };
    ASSERT_TRUE(until([&] { return level_is(0x4000 / 65535.0); }, [&] { send(7); }));
    const Json state = daemon->json({"get"});
    EXPECT_NEAR(state["lights"][0]["pan_rad"].get<double>(), M_PI / 2, 1e-9);
    EXPECT_EQ(state["lights"][0]["color_rgb"], Json({1.0, 0.0, 0.2}));
    EXPECT_NEAR(state["master_ratio"].get<double>(), 128 / 255.0, 1e-9);
    // Live: another universe; the old one is left.
    const std::string other =
        folder.file("other.toml", "[[patch]]\nsacn = 9\naddress = 9\ntarget = \"" + light +
                                      "\"\nchannels = [\"level\"]\n[[patch]]\nartnet = 3\naddress = 1\ntarget = "
                                      "\"nobody\"\nchannels = [\"level\"]\n");
    const Finished changed = daemon->gonio({"patch", other});
    EXPECT_EQ(changed.exit_code, 0) << changed.err;
    EXPECT_NE(changed.err.find("nobody"), std::string::npos) << "a warning: " << changed.err;
    EXPECT_TRUE(until([&] { return level_is(0.2); }, [&] { send(9); }));
    EXPECT_TRUE(until([&] { return endpoint("sacn")["universes"] == Json({9}); }));
    // What cannot be is refused, and nothing changes.
    const Json before = daemon->json({"patch"});
    const Finished bad = daemon->gonio({"patch", folder.file("bad.toml", "[[patch]]\nsacn = 1\naddress = 513\n")});
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_NE(bad.err.find("bad_patch"), std::string::npos) << bad.err;
    EXPECT_EQ(daemon->json({"patch"}), before);
    EXPECT_EQ(daemon->gonio({"patch", "--default"}).exit_code, 0);
    EXPECT_EQ(daemon->json({"patch"})["is_default"], true);
    // What it prints can be read again.
    const Finished printed = daemon->gonio({"patch"});
    EXPECT_EQ(daemon->gonio({"patch", folder.file("again.toml", printed.out)}).exit_code, 0);
    EXPECT_EQ(daemon->json({"patch"})["rows"].size(), 2u);
    EXPECT_EQ(run_program("goniod", {"--patch", folder.path("bad.toml")}).exit_code, 2);
}

// User and system time of a process, s.
double cpu_seconds(pid_t pid) {
    std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
    std::string text((std::istreambuf_iterator<char>(file)), {});
    std::istringstream fields(text.substr(text.rfind(')') + 2));
    std::string skipped;
    for (int i = 0; i < 11; ++i) fields >> skipped;
    double user = 0, system = 0;
    fields >> user >> system;
    return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

// 64 universes of 512 slots at 44 Hz, all patched, with levels that change in every packet of one slot.
TEST_F(Consoles, SixtyFourUniversesAt44HzLoseNothingAndRenderNothing) {
    TemporaryFolder folder;
    std::string text;
    for (int universe = 1; universe <= 64; ++universe)
        text += "[[patch]]\nsacn = " + std::to_string(universe) + "\naddress = 1\ntarget = \"" + light +
                "\"\nchannels = [\"roll\"]\n";
    start({"--patch", folder.file("patch.toml", text)});
    daemon->json({"report"});
    Udp desk;
    std::array<SacnPacket, 64> packets;
    for (unsigned i = 0; i < 64; ++i) {
        packets[i] = sacn(1, 128);
        packets[i].universe = i + 1;
        packets[i].sequence = 0;
    }
    std::uint8_t moving = 0;
    const auto rounds = [&](int count, bool change) {
        auto next = std::chrono::steady_clock::now();
        for (int round = 0; round < count; ++round) {
            if (change) ++moving;
            for (SacnPacket& packet : packets) {
                ++packet.sequence;
                packet.slots[100] = moving;  // not patched
                desk.send("127.0.0.1", ports["sacn"], packet.bytes());
            }
            std::this_thread::sleep_until(next += 22727us);
        }
    };
    rounds(100, false);  // the senders' first 1.5 s, and their levels
    std::this_thread::sleep_for(300ms);
    // Frames of the composite, timed by goniod itself: without packets, and then among them.
    const auto frame_ms = [&] {
        std::vector<double> times;
        for (int i = 0; i < 25; ++i) {
            const unsigned rev = daemon->rev({"set", "exposure", i % 2 == 0 ? "5" : "6"});
            times.push_back(daemon->json({"report", "--rev", std::to_string(rev)})["frame_ms"]);
        }
        std::sort(times.begin(), times.end());
        return times[times.size() / 2];
    };
    const double quiet_ms = frame_ms();
    const Json before = daemon->json({"stats"});
    const double cpu = cpu_seconds(daemon->pid());
    const auto start = std::chrono::steady_clock::now();
    rounds(220, true);
    const double time = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const double share = (cpu_seconds(daemon->pid()) - cpu) / time;
    std::this_thread::sleep_for(500ms);
    const Json after = daemon->json({"stats"});
    std::thread sending([&] { rounds(220, true); });
    const double busy_ms = frame_ms();
    sending.join();
    std::this_thread::sleep_for(500ms);
    std::printf("64 universes at %.1f Hz: %.1f %% of one core; a frame takes %.2f ms without and %.2f ms among them\n",
                220 / time, 100 * share, quiet_ms, busy_ms);
    // Machines differ and have other things to do: this guards against packets that hold up frames, not against noise.
    EXPECT_LT(busy_ms, 2.0 * quiet_ms + 2.0);
    const Json end = daemon->json({"stats"});
    EXPECT_EQ(before["frames_rendered"], after["frames_rendered"]);
    EXPECT_EQ(before["scene_rev"], after["scene_rev"]);
    const Json sacn_end = end["sources"]["endpoints"][0];
    EXPECT_EQ(sacn_end["packets"], 64 * 540);
    EXPECT_EQ(sacn_end["kernel_drops"], 0);
    EXPECT_EQ(sacn_end["bad_packets"], 0);
    EXPECT_EQ(sacn_end["refused_sources"], 0);
    ASSERT_EQ(end["sources"]["sources"].size(), 64u);
    for (const Json& row : end["sources"]["sources"]) {
        EXPECT_EQ(row["lost"], 0);
        EXPECT_EQ(row["out_of_order"], 0);
        EXPECT_EQ(row["packets"], 540);
    }
    EXPECT_LT(share, 0.5);
}

TEST(ConsoleOptions, NothingListensUnlessAskedAndBadPlacesAreNamed) {
    DaemonProcess daemon({"--size", "64x64"});
    EXPECT_TRUE(daemon.json({"sources"})["endpoints"].empty());
    EXPECT_NE(daemon.gonio({"sources"}).out.find("--sacn"), std::string::npos);
    for (const char* option : {"--sacn", "--artnet", "--osc"}) {
        DaemonProcess listening({"--size", "64x64", option, "127.0.0.1:0"});
        listening.json({"stats"});
        std::this_thread::sleep_for(500ms);
        const double before = cpu_seconds(listening.pid());
        std::this_thread::sleep_for(1s);
        EXPECT_LT(cpu_seconds(listening.pid()) - before, 0.2) << option << ": who hears nothing does nothing";
    }
    for (const char* option : {"--sacn", "--artnet", "--osc"}) {
        const Finished bad = run_program("goniod", {option, "everywhere"});
        EXPECT_EQ(bad.exit_code, 2);
        EXPECT_NE(bad.err.find("everywhere"), std::string::npos) << bad.err;
    }
    EXPECT_NE(run_program("goniod", {"--listen", "127.0.0.1:0", "--size", "64x64", "--sacn", "192.0.2.1"}).exit_code,
              0);
}

}  // namespace
}  // namespace gonio::test
