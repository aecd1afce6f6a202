// Consoles as the network brings them: packets to the real goniod, levels in the scene, frames of the composite alone.
#include "ies/core/zip.h"
#include "tests/e2e/consoles_fixture.h"

namespace gonio::test {
namespace {

TEST_F(Consoles, SacnByMulticastIsALevelAndAFrameOfTheCompositeAlone) {
    start({"--renderer", "gl"});
    Udp desk;
    const auto send = [&](std::uint8_t value) { desk.send("239.255.0.1", ports["sacn"], sacn(1, value).bytes()); };
    first_picture();
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
    daemon->rev({"group", "one", light});  // which is no reason to take it back either
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

// Synchronised levels wait for their packet. When none comes they count again, or stay, as the sender says.
TEST_F(Consoles, SacnSynchronizationHoldsLevelsAndItsLossLetsThemGo) {
    Udp desk;
    std::uint8_t numbers = 0;
    const auto levels = [&](std::uint8_t value, std::uint8_t options) {
        SacnPacket packet = sacn(1, value);
        packet.sync = 900;
        packet.options = options;
        desk.send("239.255.0.1", ports["sacn"], packet.bytes());
    };
    // The group of the synchronization universe, 900 = 0x0384, is joined because a patched universe names it.
    const auto synchronise = [&] { desk.send("239.255.3.132", ports["sacn"], sacn_sync(1, numbers++, 900)); };
    constexpr std::uint8_t kForce = 0x20;
    ASSERT_TRUE(until([&] { return level_is(51 / 255.0); }, [&] { levels(51, kForce), synchronise(); }));
    EXPECT_EQ(source("sacn")["sync_universe"], 900);
    for (int i = 0; i < 30; ++i) levels(102, kForce), std::this_thread::sleep_for(25ms);
    EXPECT_TRUE(level_is(51 / 255.0)) << "not before its packet";
    synchronise();
    EXPECT_TRUE(until([&] { return level_is(102 / 255.0); }, [] {}, 1s));
    // The loss: with Force_Synchronization set levels are live again after 2.5 s.
    const auto lost = std::chrono::steady_clock::now();
    EXPECT_TRUE(until([&] { return level_is(153 / 255.0); }, [&] { levels(153, kForce); }));
    EXPECT_GE(std::chrono::steady_clock::now() - lost, 2000ms);
    // With the bit clear they stay until synchronization comes back.
    EXPECT_TRUE(until([&] { return level_is(204 / 255.0); }, [&] { levels(204, 0), synchronise(); }));
    EXPECT_FALSE(until([&] { return level_is(10 / 255.0); }, [&] { levels(10, 0); }, 3500ms));
    EXPECT_TRUE(until([&] { return level_is(10 / 255.0); }, [&] { levels(10, 0), synchronise(); }));
}

TEST_F(Consoles, PrioritiesPerSlotDecideSlotBySlot) {
    daemon->json({"add", "light", "second", "--profile", "flood"});
    Udp desk, backup;
    const auto send = [&](const Udp& from, std::uint8_t cid, std::uint8_t start_code, std::vector<std::uint8_t> slots) {
        SacnPacket packet = sacn(cid, 0);
        packet.start_code = start_code;
        packet.slots = std::move(slots);
        from.send("127.0.0.1", ports["sacn"], packet.bytes());
    };
    const auto both = [&] {
        send(desk, 1, 0x00, {51, 51});
        send(desk, 1, 0xDD, {150, 50});
        send(backup, 2, 0x00, {204, 204});  // by the priority of the universe, 100
    };
    const auto second = [&] { return daemon->json({"get", "lights.second.level_ratio"}).get<double>(); };
    EXPECT_TRUE(until([&] { return level_is(0.2) && std::abs(second() - 0.8) < 1e-9; }, both)) << level() << second();
    // 0 does not control the slot.
    EXPECT_TRUE(until([&] { return level_is(0.8); },
                      [&] {
                          send(desk, 1, 0x00, {51, 51});
                          send(desk, 1, 0xDD, {0, 200});
                          send(backup, 2, 0x00, {204, 204});
                      }));
    EXPECT_NEAR(second(), 0.2, 1e-9);
    EXPECT_EQ(source("sacn")["slot_priorities"], true);
}

TEST_F(Consoles, PreviewIsHeardUnlessSwitchedOff) {
    for (const bool ignored : {false, true}) {
        if (ignored) start({"--ignore-preview"});
        Udp desk;
        const auto preview = [&](std::uint8_t options) {
            SacnPacket packet = sacn(1, options != 0 ? 51 : 102);
            packet.options = options;
            desk.send("239.255.0.1", ports["sacn"], packet.bytes());
        };
        EXPECT_EQ(until([&] { return level_is(0.2); }, [&] { preview(0x80); }, ignored ? 3000ms : 10000ms), !ignored);
        if (!ignored) {
            EXPECT_EQ(source("sacn")["preview"], true);
        } else {
            EXPECT_TRUE(until([&] { return level_is(0.4); }, [&] { preview(0); })) << "what is no preview is heard";
        }
    }
}

TEST_F(Consoles, UniverseDiscoveryListsWhatIsNotPatched) {
    Udp desk;
    // Universe 64214 = 0xFAD6, in two pages.
    EXPECT_TRUE(until(
        [&] {
            const Json table = daemon->json({"sources"});
            return table["discovered"].size() == 1 && table["discovered"][0]["universes"] == Json({3, 4, 5, 300});
        },
        [&] {
            desk.send("239.255.250.214", ports["sacn"], sacn_discovery(1, 0, 1, {3, 4, 5}));
            desk.send("239.255.250.214", ports["sacn"], sacn_discovery(1, 1, 1, {300}));
        }));
    EXPECT_NE(daemon->gonio({"sources"}).out.find("lister at 127.0.0.1"), std::string::npos);
    EXPECT_NE(daemon->gonio({"sources"}).out.find("3-5,300"), std::string::npos);
    EXPECT_TRUE(daemon->json({"sources"})["sources"].empty()) << "and are not joined";
}

TEST_F(Consoles, ArtSyncHoldsLevelsUntilTheNextOneOrForFourSeconds) {
    Udp desk;
    const auto levels = [&](std::uint8_t value) { desk.send("127.0.0.1", ports["artnet"], art_dmx(0, 0, {value, 0})); };
    const auto synchronise = [&] { desk.send("127.0.0.1", ports["artnet"], art_header(0x5200, 14)); };
    ASSERT_TRUE(until([&] { return level_is(0.2); }, [&] { levels(51), synchronise(); }));
    levels(102);
    std::this_thread::sleep_for(500ms);
    EXPECT_TRUE(level_is(0.2)) << "not before the next ArtSync";
    synchronise();
    EXPECT_TRUE(until([&] { return level_is(0.4); }, [] {}, 1s));
    const auto lost = std::chrono::steady_clock::now();
    EXPECT_TRUE(until([&] { return level_is(0.6); }, [&] { levels(153); }));
    EXPECT_GE(std::chrono::steady_clock::now() - lost, 3500ms);
}

TEST_F(Consoles, AnyAddressJoinsOnTheLoopbackInterfaceToo) {
    start({}, "0.0.0.0:0");
    Udp desk;
    EXPECT_TRUE(
        until([&] { return level_is(0.2); }, [&] { desk.send("239.255.0.1", ports["sacn"], sacn(1, 51).bytes()); }));
    EXPECT_EQ(source("sacn")["out_of_order"], 0) << "each packet is heard once";
}

TEST_F(Consoles, SacnSwingsAHeadThatAnMvrShowHasPatched) {
    start({"--renderer", "gl"});
    const auto channel = [](const char* geometry, const char* attribute, const char* offset, const char* range) {
        return std::string("<DMXChannel Offset='") + offset + "' Geometry='" + geometry +
               "'><LogicalChannel Attribute='" + attribute + "'><ChannelFunction Attribute='" + attribute +
               "' DMXFrom='0/1' Default='0/1' " + range + "/></LogicalChannel></DMXChannel>";
    };
    const auto type = write_zip(std::vector<ZipFile>{
        {"description.xml",
         "<GDTF><FixtureType Name='Head'><Geometries><Axis Name='Yoke'><Axis Name='Body'><Beam Name='Lens' "
         "LuminousFlux='5000' BeamAngle='20' FieldAngle='30'/></Axis></Axis></Geometries><DMXModes><DMXMode Name='M' "
         "Geometry='Yoke'><DMXChannels>" +
             channel("Yoke", "Pan", "1,2", "PhysicalFrom='-270' PhysicalTo='270'") +
             channel("Body", "Tilt", "3,4", "PhysicalFrom='-135' PhysicalTo='135'") +
             channel("Lens", "Dimmer", "5", "") + channel("Lens", "Zoom", "6", "PhysicalFrom='10' PhysicalTo='50'") +
             channel("Lens", "Shutter1", "7", "PhysicalFrom='0' PhysicalTo='1'") +
             "</DMXChannels></DMXMode></DMXModes></FixtureType></GDTF>"}});
    ASSERT_TRUE(type);
    const auto show = write_zip(std::vector<ZipFile>{
        {"GeneralSceneDescription.xml",
         "<GeneralSceneDescription verMajor='1' verMinor='6'><Scene><Layers><Layer name='L'><ChildList><Fixture "
         "name='Hung'><Matrix>{1,0,0}{0,1,0}{0,0,1}{0,0,5000}</Matrix><GDTFSpec>Maker@Head</GDTFSpec><Addresses>"
         "<Address break='0'>11</Address></Addresses></Fixture></ChildList></Layer></Layers></Scene>"
         "</GeneralSceneDescription>"},
        {"Maker@Head.gdtf", *type}});
    ASSERT_TRUE(show);
    TemporaryFolder folder;
    daemon->rev({"load", "scene", folder.file("show.mvr", *show)});
    Udp desk;
    std::uint8_t shutter = 255;
    const auto send = [&] {
        SacnPacket packet = sacn(1, 0);
        packet.slots.resize(512);
        packet.slots[10] = packet.slots[11] = 0x55;  // pan -90°
        packet.slots[12] = packet.slots[13] = 0xD5;  // tilt 90.5°
        packet.slots[14] = 51;
        packet.slots[15] = 204;  // zoom 42°
        packet.slots[16] = shutter;
        desk.send("127.0.0.1", ports["sacn"], packet.bytes());
    };
    const auto of_head = [&](const char* property) {
        return daemon->json({"get", std::string("lights.Hung.") + property}).get<double>();
    };
    ASSERT_TRUE(until([&] { return std::abs(of_head("level_ratio") - 0.2) < 1e-9; }, send));
    EXPECT_NEAR(of_head("pan_rad"), -1.5708, 1e-4);
    EXPECT_NEAR(of_head("tilt_rad"), (-135 + 270 * 54741 / 65535.0) * 3.14159265 / 180, 1e-4);
    // A head that hangs, panned by -90° and tilted by 90°, aims along +X.
    EXPECT_NEAR(daemon->json({"get", "lights.Hung.aim"})[0].get<double>(), 1.0, 1e-3);
    EXPECT_NEAR(of_head("zoom_rad"), 42 * 3.14159265 / 180, 1e-6);
    const auto lux = [&] {  // 4 m along the beam
        return daemon->json({"meter", "--point", "4,5,0", "--normal", "-1,0,0"})["total_lx"].get<double>();
    };
    // 10,426 cd: 5,000 lm over 2π ∫ 2^-((θ/21°)^2.9609) sin θ dθ; a fifth of them, over 4² m².
    EXPECT_NEAR(lux(), 130.3, 1.3);
    shutter = 0;
    ASSERT_TRUE(until([&] { return of_head("shutter_ratio") == 0.0; }, send));
    EXPECT_EQ(lux(), 0.0);
}

TEST_F(Consoles, ARefusedChannelHoldsUpNoOtherAndIsTold) {
    TemporaryFolder folder;
    start({"--patch", folder.file("patch.toml", "[[patch]]\nsacn = 1\naddress = 1\ntarget = \"" + light +
                                                    "\"\nchannels = [\"level\", \"aim\"]\nrange.aim = [0, 1]\n")});
    Udp desk;  // slots 2 to 4 are 0: a direction of no length
    EXPECT_TRUE(
        until([&] { return level_is(0.2); }, [&] { desk.send("127.0.0.1", ports["sacn"], sacn(1, 51).bytes()); }));
    EXPECT_TRUE(until([&] {
        return endpoint("sacn")["last_error"].get<std::string>().find("set_light.aim") != std::string::npos;
    })) << endpoint("sacn");
}

// A group or light that comes later hears what the console says now; what the page has set elsewhere stays.
TEST_F(Consoles, ALightThatComesLaterHearsTheConsole) {
    TemporaryFolder folder;
    start({"--patch", folder.file("patch.toml", "[[patch]]\nsacn = 1\naddress = 1\ntarget = \"" + light +
                                                    "\"\nchannels = [\"level\"]\n[[patch]]\nsacn = 1\naddress = 2\n"
                                                    "target = \"late\"\nchannels = [\"level\"]\n")});
    Udp desk;
    const auto send = [&] {
        SacnPacket packet = sacn(1, 51);
        packet.slots[1] = 102;
        desk.send("127.0.0.1", ports["sacn"], packet.bytes());
    };
    ASSERT_TRUE(until([&] { return level_is(0.2); }, send));
    daemon->rev({"set", "light", light, "--level", "0.75"});
    daemon->json({"add", "light", "spot", "--profile", "flood"});
    daemon->rev({"group", "late", "spot"});
    const auto of_spot = [&] { return daemon->json({"get", "lights.spot.level_ratio"}).get<double>(); };
    EXPECT_TRUE(until([&] { return std::abs(of_spot() - 0.4) < 1e-9; }, send)) << of_spot();
    EXPECT_TRUE(level_is(0.75)) << "the page's hand on another light";
    daemon->rev({"remove", "light", "spot"});
    daemon->json({"add", "light", "late", "--profile", "flood"});
    EXPECT_TRUE(until(
        [&] {
            return std::abs(daemon->json({"get", "lights.late.level_ratio"}).get<double>() - 0.4) < 1e-9;
        },
        send));
}

TEST_F(Consoles, ArtnetIsALevelAndPollsAreAnswered) {
    start({"--renderer", "gl"});
    Udp desk;
    std::uint8_t number = 0;
    const auto send = [&] {
        desk.send("127.0.0.1", ports["artnet"],
                  art_dmx(number = static_cast<std::uint8_t>(number % 255 + 1), 0, {102, 0}));
    };
    first_picture();
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
    start({"--renderer", "gl"});
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
    first_picture();
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
    // A group is asked like a light; patterns may stand in any part.
    daemon->rev({"group", "all", light});
    ASSERT_TRUE(until([&] {
        send(panel, osc("/group/all/level"));
        const auto packet = panel.receive(200ms);
        return packet && decode_osc(*packet) && (*decode_osc(*packet))[0].address == "/group/all/level";
    }));
    send(panel, osc("/l*/" + encode_osc_name(light) + "/level"));
    EXPECT_TRUE(hear(panel, root + "/level"));
    send(panel, osc(root + "/{pan,tilt}", {30.0F}));
    EXPECT_TRUE(until([&] {
        return std::abs(daemon->json({"get", "lights[0].tilt_rad"}).get<double>() - M_PI / 6) < 1e-6;
    }));
    EXPECT_NEAR(daemon->json({"get", "lights[0].pan_rad"}).get<double>(), M_PI / 6, 1e-6);
    // Red and green in one frame: neither takes the other back.
    send(panel,
         encode_osc_bundle({{kOscImmediately, root + "/red", {0.25F}}, {kOscImmediately, root + "/green", {0.5F}}}));
    EXPECT_TRUE(until([&] {
        const Json color = daemon->json({"get", "lights[0].color_rgb"});
        return color[0] == 0.25 && color[1] == 0.5;
    }));
    // Another port for the feedback, as tablets want it.
    Udp listening;
    send(panel, osc("/gonio/subscribe", {static_cast<std::int32_t>(listening.port())}));
    EXPECT_TRUE(hear(listening, root + "/position"));
    EXPECT_TRUE(until([&] { return source("osc")["protocol"] == "osc"; })) << endpoint("osc");
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

TEST(ConsoleOptions, NothingListensUnlessAskedAndBadPlacesAreNamed) {
    DaemonProcess daemon({"--size", "64x64"});
    EXPECT_TRUE(daemon.json({"sources"})["endpoints"].empty());
    EXPECT_NE(daemon.gonio({"sources"}).out.find("--sacn"), std::string::npos);
    {
        DaemonProcess listening(
            {"--size", "64x64", "--sacn", "127.0.0.1:0", "--artnet", "127.0.0.1:0", "--osc", "127.0.0.1:0"});
        listening.transport_ready();
        EXPECT_TRUE(comes_to_rest(listening.pid(), 0.1)) << "who hears nothing does nothing";
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
