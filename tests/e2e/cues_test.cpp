// Cues as their users meet them: GO from gonio, over OSC and from a button of a box, time code, and what a fade costs.
#include "tests/e2e/consoles_fixture.h"

namespace gonio::test {
namespace {

class Cues : public Consoles {
protected:
    // The list of three: dark, half, full; cue 1 is active and level is 0.
    void make_list() {
        const auto add = [&](const std::string& number, const std::string& level, const std::string& up_s) {
            daemon->rev({"set", "light", light, "--level", level});
            daemon->rev({"cue", "add", number, "--up", up_s, "--label", "cue " + number});
        };
        add("1", "0", "0");
        add("2", "0.5", "0.5");
        add("10", "1", "0");
        daemon->rev({"cue", "goto", "1", "--time", "0"});
    }
    Json playback() { return daemon->json({"cue", "list"})["cue_playback"]; }
    bool active_is(const std::string& number) { return playback()["active"] == number; }
    void send(const Packet& packet) { panel.send("127.0.0.1", ports["osc"], packet); }
    Udp panel;
};

TEST_F(Cues, GoFromTheCommandLine) {
    make_list();
    EXPECT_TRUE(level_is(0));
    Json cues = daemon->json({"cue", "list"});
    ASSERT_EQ(cues["cues"]["cues"].size(), 3u);
    EXPECT_EQ(cues["cues"]["cues"][2]["number"], "10") << "10 is after 2";
    EXPECT_EQ(playback()["next"], "2");
    daemon->rev({"cue", "go"});
    EXPECT_TRUE(until([&] { return level_is(0.5); })) << level();
    EXPECT_TRUE(active_is("2"));
    EXPECT_TRUE(until([&] { return playback()["running"] == false; }));
    const Finished list = daemon->gonio({"cue", "list"});
    EXPECT_NE(list.out.find("cue 10"), std::string::npos) << list.out;
    daemon->rev({"cue", "back", "--time", "0"});
    EXPECT_TRUE(level_is(0));
    daemon->rev({"cue", "goto", "10"});
    EXPECT_TRUE(level_is(1));
    const Finished over = daemon->gonio({"cue", "go"});
    EXPECT_EQ(over.exit_code, 1);
    EXPECT_NE(over.err.find("not_found cue_go"), std::string::npos) << over.err;
    EXPECT_EQ(daemon->gonio({"cue", "add", "3", "--follow", "1", "--hang", "1"}).exit_code, 1);
    EXPECT_EQ(daemon->gonio({"cue", "add"}).exit_code, 2);
    daemon->rev({"cue", "set", "10", "--label", "Finale", "--hang", "3"});
    daemon->rev({"cue", "options", "--next", "1"});
    EXPECT_EQ(playback()["next"], "1");
    daemon->rev({"cue", "remove", "2"});
    EXPECT_EQ(daemon->json({"cue", "list"})["cues"]["cues"].size(), 2u);
}

TEST_F(Cues, ASecondGoIsRefusedAndStopHolds) {
    make_list();
    daemon->rev({"cue", "options", "--guard", "5"});
    daemon->rev({"cue", "set", "2", "--up", "100"});
    daemon->rev({"cue", "go"});
    const Finished twice = daemon->gonio({"cue", "go"});
    EXPECT_EQ(twice.exit_code, 1);
    EXPECT_NE(twice.err.find("too_soon cue_go"), std::string::npos) << twice.err;
    daemon->rev({"cue", "stop"});
    EXPECT_EQ(playback()["held"], true);
    const double held = level();
    EXPECT_GT(held, 0);
    std::this_thread::sleep_for(300ms);
    EXPECT_EQ(level(), held);
    daemon->rev({"cue", "go"});
    EXPECT_TRUE(until([&] { return level() > held; }));
    EXPECT_TRUE(active_is("2"));
}

// The cost of a level, while it fades and when it has ended.
TEST_F(Cues, AFadeRunsTheCompositeAloneAndThenNothing) {
    start({"--renderer", "gl"});
    make_list();
    first_picture();
    const unsigned rev = daemon->rev({"cue", "go"});
    expect_composite_only();
    EXPECT_TRUE(until([&] { return level_is(0.5); }));
    EXPECT_GT(daemon->json({"get", "scene_rev"}).get<unsigned>(), rev) << "in steps";
    expect_composite_only();
    EXPECT_TRUE(until([&] { return daemon->json({"stats"})["settled"] == true; }));
    const Json report = daemon->json({"report"});
    for (const Json& pass : report["passes"]) EXPECT_NE(pass["state"], "ran") << pass["name"];
}

TEST_F(Cues, GoOverOsc) {
    make_list();
    send(osc("/gonio/cue/go", {0.0F}));  // let go
    send(osc("/gonio/cue/go", {1.0F}));
    EXPECT_TRUE(until([&] { return active_is("2"); }));
    std::this_thread::sleep_for(300ms);
    send(osc("/gonio/cue/10/fire"));
    EXPECT_TRUE(until([&] { return level_is(1); }));
    send(osc("/gonio/cue/back"));
    EXPECT_TRUE(until([&] { return active_is("2"); }));
    send(osc("/gonio/cue/99/fire"));
    EXPECT_TRUE(until([&] { return endpoint("osc")["last_error"].get<std::string>().find("99") != std::string::npos; }))
        << endpoint("osc");
    send(osc("/eos/key/go_0", {1.0F}));
    std::this_thread::sleep_for(300ms);
    EXPECT_TRUE(active_is("2")) << "Eos was not asked for";
}

TEST_F(Cues, AddressesOfEos) {
    start({"--osc-eos"});
    make_list();
    std::set<std::string> heard;
    const auto hear = [&](const std::string& address) {
        return until([&] {
            while (const auto packet = panel.receive(10ms))
                if (const auto messages = decode_osc(*packet))
                    for (const OscMessage& message : *messages) heard.insert(message.address);
            return heard.contains(address);
        });
    };
    send(osc("/eos/ping", {std::string("x")}));
    EXPECT_TRUE(hear("/eos/out/ping"));
    send(osc("/eos/subscribe", {std::int32_t{1}}));
    EXPECT_TRUE(hear("/eos/out/active/cue/1/1"));
    EXPECT_TRUE(hear("/eos/out/pending/cue/1/2"));
    send(osc("/eos/key/go_0", {1.0F}));
    send(osc("/eos/key/go_0", {0.0F}));
    EXPECT_TRUE(hear("/eos/out/active/cue/1/2"));
    EXPECT_TRUE(hear("/eos/out/pending/cue/1/10"));
    EXPECT_TRUE(hear("/eos/out/active/cue/text"));
    send(osc("/eos/cue/1/10/fire"));
    EXPECT_TRUE(until([&] { return level_is(1); }));
    send(osc("/eos/key/stop", {1.0F}));
    EXPECT_TRUE(active_is("10")) << "nothing runs";
}

TEST_F(Cues, ArtNetTimeCodeStartsThem) {
    make_list();
    daemon->rev({"cue", "set", "2", "--timecode", "01:00:10:00"});
    daemon->rev({"cue", "options", "--timecode", "artnet"});
    Udp desk;
    int frame = 0;
    const auto tick = [&] {
        const int at = 9 * 25 + 12 + frame++;  // from 01:00:09:12 on, one frame each 25 ms
        Packet packet = {'A', 'r', 't', '-', 'N', 'e', 't', 0, 0x00, 0x97, 0, 14, 0, 0};
        for (const int part : {at % 25, at / 25 % 60, 0, 1, 1}) packet.push_back(static_cast<std::uint8_t>(part));
        desk.send("127.0.0.1", ports["artnet"], packet);
    };
    EXPECT_TRUE(until([&] { return playback()["chase"] == "running"; }, tick));
    EXPECT_TRUE(until([&] { return active_is("2"); }, tick));
    EXPECT_TRUE(until([&] { return playback()["chase"] == "holding"; })) << "it ended";
}

// A button of a box, and time code from its MIDI port.
TEST(CueBoxes, AButtonIsGoAndMidiTimeCodeStartsThem) {
    TemporaryFolder folder;
    std::string text = "midi 1234:5678 Buttons\n";
    const auto line = [&](int at_ms, const std::string& bytes) { text += std::to_string(at_ms) + " " + bytes + "\n"; };
    for (int i = 0; i < 4; ++i) {  // note 60, pressed and let go, every two seconds
        line(4000 + 2000 * i, "90 3C 7F");
        line(4100 + 2000 * i, "80 3C 00");
    }
    const std::string map =
        folder.file("map.toml", "[[control]]\ncontrol = \"note 1/60\"\nproperty = \"cue\"\ncue = \"go\"\n");
    DaemonProcess daemon({"--size", "64x64", "--surfaces", "off", "--surface-replay", folder.file("box.txt", text),
                          "--surface-map", map});
    for (const char* number : {"1", "2", "3"}) daemon.rev({"cue", "add", number, "--up", "0"});
    std::set<std::string> seen;
    const auto end = std::chrono::steady_clock::now() + 20s;
    while (seen.size() < 3 && std::chrono::steady_clock::now() < end) {
        seen.insert(daemon.json({"cue", "list"})["cue_playback"]["active"].get<std::string>());
        std::this_thread::sleep_for(50ms);
    }
    EXPECT_TRUE(seen.contains("2")) << "one press is one GO";
    EXPECT_TRUE(seen.contains("3") || seen.contains("1"));

    text = "midi 1234:5678 Clock\n";
    for (int i = 0; i < 800; ++i) {  // quarter frames at 25 frames a second, from 01:00:00:00 on
        const int frame = i / 8 * 2, piece = i % 8;
        const int parts[8] = {frame % 25 & 15, frame % 25 >> 4, frame / 25 % 60 & 15, frame / 25 % 60 >> 4, 0, 0, 1, 2};
        char bytes[16];
        std::snprintf(bytes, sizeof bytes, "F1 %X%X", piece, parts[piece]);
        line(3000 + i * 10, bytes);
    }
    DaemonProcess chased({"--size", "64x64", "--surfaces", "off", "--surface-replay", folder.file("clock.txt", text)});
    chased.rev({"cue", "add", "1", "--up", "0", "--timecode", "01:00:05:00"});
    chased.rev({"cue", "options", "--timecode", "mtc"});
    bool started = false;
    for (const auto until = std::chrono::steady_clock::now() + 20s;
         !started && std::chrono::steady_clock::now() < until; std::this_thread::sleep_for(50ms))
        started = chased.json({"cue", "list"})["cue_playback"]["active"] == "1";
    EXPECT_TRUE(started);
}

}  // namespace
}  // namespace gonio::test
