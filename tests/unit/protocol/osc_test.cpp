// OSC 1.0: byte vectors, patterns, the framings of TCP, and what addresses mean.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "protocol/osc/osc.h"
#include "protocol/osc/osc_space.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"

namespace gonio {
namespace {

Bytes bytes_of(std::string_view text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

using namespace std::string_literals;
using namespace std::string_view_literals;

// The examples of the OSC 1.0 specification.
TEST(Osc, TheExamplesOfTheSpecificationDecode) {
    const auto one = decode_osc(bytes_of("/oscillator/4/frequency\0,f\0\0\x43\xdc\0\0"sv));
    ASSERT_TRUE(one) << one.error().text();
    ASSERT_EQ(one->size(), 1u);
    EXPECT_EQ((*one)[0].address, "/oscillator/4/frequency");
    EXPECT_EQ(std::get<float>((*one)[0].arguments.at(0)), 440.0F);
    const auto two = decode_osc(
        bytes_of("/foo\0\0\0\0,iisff\0\0\0\0\x03\xe8\xff\xff\xff\xffhello\0\0\0\x3f\x9d\xf3\xb6\x40\xb5\xb2\x2d"sv));
    ASSERT_TRUE(two) << two.error().text();
    const std::vector<OscArgument> expected = {1000, -1, std::string("hello"), 1.234F, 5.678F};
    EXPECT_EQ((*two)[0].arguments, expected);
}

TEST(Osc, EveryArgumentComesBack) {
    const OscMessage message{kOscImmediately,
                             "/a/b",
                             {std::int32_t{-5}, std::int64_t{1} << 40, 0.25F, -1e300, std::string("text"),
                              OscBlob{1, 2, 3, 4, 5}, true, false, OscNil{}, OscImpulse{}}};
    const auto packet = encode_osc(message);
    EXPECT_EQ(packet.size() % 4, 0u);
    const auto decoded = decode_osc(packet);
    ASSERT_TRUE(decoded) << decoded.error().text();
    EXPECT_EQ(*decoded, std::vector{message});
}

TEST(Osc, BundlesNestAndCarryTheirTimeTag) {
    std::string inner = "#bundle\0\0\0\0\2\x80\0\0\0\0\0\0\x8/b\0\0,\0\0\0"s;
    std::string outer =
        "#bundle\0\0\0\0\0\0\0\0\1\0\0\0\x8/a\0\0,\0\0\0\0\0\0"s + static_cast<char>(inner.size()) + inner;
    const auto decoded = decode_osc(bytes_of(outer));
    ASSERT_TRUE(decoded) << decoded.error().text();
    ASSERT_EQ(decoded->size(), 2u);
    EXPECT_EQ((*decoded)[0].address, "/a");
    EXPECT_EQ((*decoded)[0].time_tag, kOscImmediately);
    EXPECT_EQ((*decoded)[1].address, "/b");
    EXPECT_EQ((*decoded)[1].time_tag, 0x2'80000000u);
    EXPECT_EQ(decode_osc(encode_osc_bundle(*decoded))->size(), 2u);
    EXPECT_FALSE(osc_wall_ns(kOscImmediately));
    // 2208988800 s from 1900 to 1970, and a half second.
    EXPECT_EQ(osc_wall_ns((std::uint64_t{2208988801} << 32) | 0x80000000u), 1'500'000'000);
}

TEST(Osc, OlderSendersWithoutTypeTags) {
    const auto decoded = decode_osc(bytes_of("/ping\0\0\0"sv));
    ASSERT_TRUE(decoded);
    EXPECT_TRUE((*decoded)[0].arguments.empty());
}

TEST(Osc, WhatIsNoPacketIsRefusedWithItsPlace) {
    std::string deep = "/a\0\0,\0\0\0"s;
    for (int i = 0; i < 18; ++i)
        deep = "#bundle\0\0\0\0\0\0\0\0\1\0\0"s + static_cast<char>(deep.size() >> 8) + static_cast<char>(deep.size()) +
               deep;
    for (const std::string& text :
         {""s, "/a\0"s, "abc\0"s, "/abc"s, "/a\0\0,f\0\0"s, "/a\0\0,i\0\0\0\0"s, "/a\0\0,s\0\0abcd"s,
          "/a\0\0,b\0\0\0\0\0\x9\1\2\3\4"s, "/a\0\0,b\0\0\xff\xff\xff\xff"s, "/a\0\0,q\0\0"s, "/a\1\0,\0\0\0"s,
          "#bundle\0\0\0\0\0"s, "#bundle\0\0\0\0\0\0\0\0\1\0\0\0\x9/b\0\0,\0\0\0"s,
          "#bundle\0\0\0\0\0\0\0\0\1\0\0\0\0"s, deep}) {
        const auto decoded = decode_osc(bytes_of(text));
        ASSERT_FALSE(decoded) << testing::PrintToString(text);
        EXPECT_EQ(decoded.error().code, "bad_packet");
        EXPECT_TRUE(decoded.error().where.starts_with("byte ")) << decoded.error().where;
    }
}

TEST(Osc, PatternsMatch) {
    struct Case {
        const char *pattern, *name;
        bool matches;
    };
    for (const Case& c : std::initializer_list<Case>{{"lamp", "lamp", true},
                                                     {"lamp", "lam", false},
                                                     {"?amp", "lamp", true},
                                                     {"?", "", false},
                                                     {"*", "", true},
                                                     {"*", "anything", true},
                                                     {"l*p", "lamp", true},
                                                     {"l*p", "lp", true},
                                                     {"l*p", "lampe", false},
                                                     {"[k-m]amp", "lamp", true},
                                                     {"[!k-m]amp", "lamp", false},
                                                     {"[!a-c]amp", "lamp", true},
                                                     {"[abc]", "b", true},
                                                     {"[a-]", "-", true},
                                                     {"{lamp,spot}", "spot", true},
                                                     {"{lamp,spot}", "spo", false},
                                                     {"x{a,ab}c", "xabc", true},
                                                     {"{a,}b", "b", true},
                                                     {"*{1,2}", "spot2", true},
                                                     {"a*b*c", "aXbYc", true},
                                                     {"[", "a", false},
                                                     {"{a", "a", true},
                                                     {"", "", true},
                                                     {"", "a", false}}) {
        EXPECT_EQ(osc_matches(c.pattern, c.name), c.matches) << c.pattern << " " << c.name;
    }
    EXPECT_FALSE(osc_matches("*", std::string(kOscMaxAddress, 'a'))) << "longer than any address";
    EXPECT_TRUE(osc_matches("*", std::string(kOscMaxAddress - 1, 'a')));
}

// Whatever a pattern holds, twice as much of it against a name of twice the length takes about four times as long. A
// matcher that goes back takes thousands of times as long.
TEST(Osc, NoPatternIsSlow) {
    const auto patterns = [](int size) {
        std::vector<std::string> evil(5);
        for (int i = 0; i < 24 * size; ++i) evil[0] += "*a";
        for (int i = 0; i < 48 * size; ++i) evil[1] += "*";
        for (int i = 0; i < 9 * size; ++i) evil[2] += "[!-~]";
        for (int i = 0; i < 20 * size; ++i) evil[3] += ",a";
        evil[3] = "*{" + evil[3] + "}";
        for (int i = 0; i < 8 * size; ++i) evil[4] += "{,a,}";
        return evil;
    };
    for (std::size_t which = 0; which < 5; ++which) {
        // The least of some times: what else the machine does only adds to them.
        const auto least_ms = [&](int size) {
            const std::string pattern = patterns(size)[which] + "b", name(static_cast<std::size_t>(38 * size), 'a');
            double least = 1e9;
            for (int times = 0; times < 20; ++times) {
                const auto begin = std::chrono::steady_clock::now();
                for (int i = 0; i < 20; ++i) EXPECT_FALSE(osc_matches(pattern, name));
                const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
                least = std::min(least, took.count());
            }
            return least;
        };
        const double half_ms = least_ms(5), whole_ms = least_ms(10);
        std::printf("pattern %zu: %.3f ms, twice as long %.3f ms\n", which, half_ms, whole_ms);
        EXPECT_LT(whole_ms, 16.0 * half_ms) << which;
    }
}

TEST(Osc, NamesThatOscReservesAreEscaped) {
    for (const std::string name : {"plain", "a b", "50% {x}/[y]*?#,", "L\xc3\xa9on", "%41"}) {
        const std::string encoded = encode_osc_name(name);
        EXPECT_EQ(encoded.find_first_of(" #*,/?[]{}"), std::string::npos);
        EXPECT_EQ(decode_osc_name(encoded), name);
    }
    EXPECT_EQ(encode_osc_name("a b"), "a%20b");
    EXPECT_EQ(decode_osc_name("100%"), "100%");
}

TEST(Osc, BothFramingsOfTcpAndTheirAnswers) {
    const auto packet = encode_osc({kOscImmediately, "/light/a/level", {std::bit_cast<float>(0x3EC0DBC0u)}});
    // OSC 1.0: a length first. Fed byte by byte.
    OscStream lengths;
    std::vector<std::uint8_t> stream = {0, 0, 0, static_cast<std::uint8_t>(packet.size())};
    stream.insert(stream.end(), packet.begin(), packet.end());
    std::vector<std::vector<std::uint8_t>> got;
    for (int round = 0; round < 2; ++round)
        for (const std::uint8_t byte : stream) {
            auto packets = lengths.feed(Bytes(&byte, 1));
            for (auto& one : *packets) got.push_back(std::move(one));
        }
    EXPECT_EQ(got, (std::vector{packet, packet}));
    EXPECT_EQ(lengths.frame(packet), stream);
    // OSC 1.1: SLIP. The float's bytes hold 0xC0 and 0xDB, which SLIP escapes.
    OscStream slip;
    OscStream other;
    ASSERT_TRUE(other.feed(bytes_of("\xc0"sv)));
    const auto framed = other.frame(packet);
    EXPECT_GT(framed.size(), packet.size() + 3);
    EXPECT_EQ(*slip.feed(framed), (std::vector<std::vector<std::uint8_t>>{packet}));
    // A stream that announces too much ends.
    EXPECT_EQ(OscStream().feed(bytes_of("\0\x7f\xff\xff"sv)).error().code, "too_large");
    EXPECT_EQ(OscStream().feed(bytes_of("\xc0\xdb\x01"sv)).error().code, "bad_packet");
}

OscMessage message(std::string address, std::vector<OscArgument> arguments = {}) {
    return {kOscImmediately, std::move(address), std::move(arguments)};
}

TEST(OscSpace, AddressesBecomeValues) {
    const auto level = osc_action(message("/light/front%20wash/level", {0.5F}));
    ASSERT_TRUE(level) << level.error().text();
    const auto& value = std::get<OscSet>(*level).at(0);
    EXPECT_EQ(value.target, "front wash");
    EXPECT_EQ(value.kind, PropertyValue::Kind::light);
    EXPECT_EQ(value.property, Property::level);
    EXPECT_DOUBLE_EQ(value.value[0], 0.5);
    const auto pan = std::get<OscSet>(*osc_action(message("/group/all/pan", {std::int32_t{90}}))).at(0);
    EXPECT_EQ(pan.kind, PropertyValue::Kind::group);
    EXPECT_DOUBLE_EQ(pan.value[0], std::numbers::pi / 2) << "degrees on the wire";
    const auto color = std::get<OscSet>(*osc_action(message("/light/a/color", {1.0F, 0.5F, 0.0}))).at(0);
    EXPECT_DOUBLE_EQ(color.value[1], 0.5);
    const auto pattern = std::get<OscSet>(*osc_action(message("/{light,group}/s*/level", {true}))).at(0);
    EXPECT_TRUE(pattern.pattern);
    EXPECT_EQ(pattern.kind, PropertyValue::Kind::any);
    EXPECT_EQ(std::get<OscSet>(*osc_action(message("/master", {0.25}))).at(0).property, Property::master);
    EXPECT_EQ(std::get<OscSet>(*osc_action(message("/light/a/profile", {std::string("flood")}))).at(0).name, "flood");
    EXPECT_TRUE(std::holds_alternative<OscQuery>(*osc_action(message("/light/a/level"))));
    EXPECT_TRUE(std::holds_alternative<OscPing>(*osc_action(message("/gonio/ping"))));
    EXPECT_EQ(std::get<OscSubscribe>(*osc_action(message("/gonio/subscribe", {9001}))).port, 9001);
    EXPECT_FALSE(std::get<OscSubscribe>(*osc_action(message("/gonio/subscribe"))).port);
}

std::vector<std::string> properties_of(const OscMessage& message) {
    std::vector<std::string> names;
    const auto action = osc_action(message);
    EXPECT_TRUE(action) << action.error().text();
    if (action)
        for (const PropertyValue& value : std::get<OscSet>(*action)) names.emplace_back(row_of(value.property).name);
    return names;
}

std::string cue_of(const OscMessage& message, bool eos = false) {
    const auto action = osc_action(message, eos);
    if (!action) return action.error().code;
    if (std::holds_alternative<OscNothing>(*action)) return "nothing";
    const auto* set = std::get_if<OscSet>(&*action);
    return set != nullptr && set->size() == 1 && set->front().property == Property::cue ? set->front().name : "other";
}

// A button sends 1 when it is pressed and 0 when it is let go, which must not fire.
TEST(OscSpace, CuesArePlayed) {
    for (const char* what : {"go", "back", "stop"}) {
        const std::string address = std::string("/gonio/cue/") + what;
        EXPECT_EQ(cue_of(message(address)), what);
        EXPECT_EQ(cue_of(message(address, {1.0F})), what);
        EXPECT_EQ(cue_of(message(address, {std::int32_t{1}})), what);
        EXPECT_EQ(cue_of(message(address, {0.0F})), "nothing");
        EXPECT_EQ(cue_of(message(address, {std::string("x")})), "invalid_argument");
    }
    EXPECT_EQ(cue_of(message("/gonio/cue/12.5/fire")), "12.5");
    EXPECT_EQ(cue_of(message("/gonio/cue/12.5/fire", {0.0F})), "nothing");
    EXPECT_EQ(cue_of(message("/cue", {std::string("go")})), "go");
    for (const char* bad : {"/gonio/cue/0/fire", "/gonio/cue/1.2345/fire", "/gonio/cue/1", "/gonio/cue/1/load",
                            "/gonio/cue/halt", "/gonio/cue/1/fire/2"})
        EXPECT_EQ(cue_of(message(bad)), "not_found") << bad;
}

// ETC's dictionary; whichever list is named, there is one.
TEST(OscSpace, AddressesOfEosWhereTheyAreWanted) {
    EXPECT_EQ(cue_of(message("/eos/key/go_0", {1.0F}), true), "go");
    EXPECT_EQ(cue_of(message("/eos/key/go_0", {0.0F}), true), "nothing");
    EXPECT_EQ(cue_of(message("/eos/key/stop"), true), "stop");
    EXPECT_EQ(cue_of(message("/eos/cue/1/7.5/fire"), true), "7.5");
    EXPECT_EQ(cue_of(message("/eos/cue/7.5/fire"), true), "7.5");
    EXPECT_STREQ(std::get<OscPing>(*osc_action(message("/eos/ping"), true)).pong, "/eos/out/ping");
    EXPECT_TRUE(std::holds_alternative<OscSubscribe>(*osc_action(message("/eos/subscribe", {1}), true)));
    EXPECT_TRUE(std::holds_alternative<OscUnsubscribe>(*osc_action(message("/eos/subscribe", {0}), true)));
    EXPECT_EQ(cue_of(message("/eos/key/blackout", {1.0F}), true), "not_found");
    EXPECT_EQ(cue_of(message("/eos/key/go_0", {1.0F}), false), "not_found") << "not asked for";
}

TEST(OscSpace, WhatEosTellsOfItsCues) {
    v1::State state;
    v1::Cue& cue = *state.mutable_cues()->add_cues();
    cue.set_number("1.5");
    cue.set_label("Sunset");
    state.mutable_cue_playback()->set_active("1.5");
    state.mutable_cue_playback()->set_next("2");
    state.mutable_cue_playback()->set_progress_ratio(0.25);
    OscValues wanted;
    wanted["/eos/out/active/cue/1/1.5"] = {0.25F};
    wanted["/eos/out/active/cue/text"] = {std::string("1.5 Sunset")};
    wanted["/eos/out/pending/cue/1/2"] = {};
    wanted["/eos/out/pending/cue/text"] = {std::string("2")};
    EXPECT_EQ(eos_values(state), wanted);
}

TEST(OscSpace, PatternsWorkInTheLastPartToo) {
    using Names = std::vector<std::string>;
    EXPECT_EQ(properties_of(message("/light/a/{pan,tilt}", {30.0F})), (Names{"pan", "tilt"}));
    EXPECT_EQ(properties_of(message("/group/*/p*", {1.0F, 2.0F, 3.0F})), (Names{"pan", "position"}));
    EXPECT_EQ(properties_of(message("/light/a/p*", {std::string("flood")})), (Names{"profile"}));
    EXPECT_EQ(properties_of(message("/{master,exposure}", {1.0F})), (Names{"master", "exposure"}));
    EXPECT_EQ(properties_of(message("/l*/a/leve?", {1.0F})), (Names{"level"}));
    // What matches and takes no such arguments is left out; if nothing is left that is told.
    EXPECT_EQ(osc_action(message("/light/a/{color,aim}", {1.0F})).error().code, "invalid_argument");
    EXPECT_EQ(osc_action(message("/light/a/{sha,shi}ne", {1.0F})).error().code, "not_found");
    EXPECT_EQ(osc_action(message("/lamp*/a/level", {1.0F})).error().code, "not_found");
    EXPECT_TRUE(std::holds_alternative<OscQuery>(*osc_action(message("/*"))));
    EXPECT_TRUE(std::holds_alternative<OscQuery>(*osc_action(message("/group/front/*"))));
}

TEST(OscSpace, AGroupHasTheValuesOfItsFirstLight) {
    v1::State state;
    for (const char* name : {"a", "b"}) {
        v1::Light& light = *state.add_lights();
        light.set_name(name);
        light.set_level_ratio(light.name() == "b" ? 0.5 : 0.25);
    }
    v1::Group& group = *state.add_groups();
    group.set_name("front wash");
    group.add_lights("b");
    group.add_lights("a");
    state.add_groups()->set_name("empty");
    const OscValues values = osc_values(state);
    EXPECT_EQ(values.at("/group/front%20wash/level"), (std::vector<OscArgument>{0.5F}));
    std::size_t budget = kOscPatternBudget;
    EXPECT_EQ(osc_select(values, "/{light,group}/*/level", budget)->size(), 3u);
    EXPECT_FALSE(values.contains("/group/empty/level"));
}

// What one packet may compare is bounded, and names are compared once, not once for each of their values.
TEST(OscSpace, PatternsHaveABudget) {
    v1::State state;
    for (int i = 0; i < 64; ++i) {
        v1::Light& light = *state.add_lights();
        light.set_name("light " + std::to_string(i));
        for (int k = 0; k < 3; ++k) light.add_color_rgb(1), light.add_position(0), light.add_aim(0);
    }
    const OscValues values = osc_values(state);
    std::size_t budget = kOscPatternBudget;
    ASSERT_TRUE(osc_select(values, "/light/*[0-9]/*", budget));
    const auto properties = static_cast<std::size_t>(
        std::ranges::count_if(property_table(), [](const PropertyRow& row) { return !row.of_scene; }));
    EXPECT_EQ(kOscPatternBudget - budget, 64 * 6 + properties + 5) << "64 names, the properties, \"light\"";
    int answered = 0;
    while (osc_select(values, "/light/*" + std::string(400, '?') + "/level", budget)) ++answered;
    EXPECT_GE(answered, 2);
    EXPECT_LE(answered, 5);
    EXPECT_EQ(osc_select(values, "/light/*" + std::string(400, '?') + "/level", budget).error().code, "too_large");
    EXPECT_TRUE(osc_select(values, "/master", budget)) << "what is no pattern costs nothing";
}

// grandMA3 sends name, number and value (midimonster, issue 126).
TEST(OscSpace, ARefusalNamesTheArguments) {
    const auto why = [](std::vector<OscArgument> arguments) {
        return osc_action(message("/light/lamp/level", std::move(arguments))).error().message;
    };
    EXPECT_EQ(why({std::string("Fader"), 1, 50.0F}), "must be a number; it came with (\"Fader\", 1, 50)");
    EXPECT_EQ(why({OscNil{}, true, OscBlob{1, 2}}), "must be a number; it came with (nil, true, a blob of 2 bytes)");
    const std::string many = why(std::vector<OscArgument>(200, std::string(100, 'x')));
    EXPECT_LT(many.size(), 400u) << many;
    EXPECT_TRUE(many.ends_with("…)")) << many;
}

// 38-osc-no-type-tags: X32-Edit sends no type tag string (liblo, issue 17).
TEST(OscSpace, WithoutTypeTagsAnAddressAsks) {
    for (const auto& [bytes, asks] :
         {std::pair{bytes_of("/gonio/ping\0"sv), false}, {bytes_of("/light/lamp/level\0\0\0"sv), true}}) {
        const auto decoded = decode_osc(bytes);
        ASSERT_TRUE(decoded);
        const auto action = osc_action((*decoded)[0]);
        ASSERT_TRUE(action);
        EXPECT_EQ(std::holds_alternative<OscQuery>(*action), asks);
        EXPECT_EQ(std::holds_alternative<OscPing>(*action), !asks);
    }
}

TEST(OscSpace, WhatMeansNothingIsRefused) {
    for (const auto& [bad, code] : {std::pair{message("/nothing", {1.0F}), "not_found"},
                                    {message("/light/a", {1.0F}), "not_found"},
                                    {message("/light/a/shine", {1.0F}), "not_found"},
                                    {message("/light/a/master", {1.0F}), "not_found"},
                                    {message("/lamp/a/level", {1.0F}), "not_found"},
                                    {message("/level", {1.0F}), "not_found"},
                                    {message("/light/a/color", {1.0F, 1.0F}), "invalid_argument"},
                                    {message("/light/a/level", {std::string("full")}), "invalid_argument"},
                                    {message("/light/a/profile", {1.0F}), "invalid_argument"},
                                    {message("/light/a/profile", {std::string(129, 'x')}), "invalid_argument"},
                                    {message("/gonio/subscribe", {70000}), "invalid_argument"},
                                    {message("/gonio/subscribe", {std::nanf("")}), "invalid_argument"}}) {
        const auto action = osc_action(bad);
        ASSERT_FALSE(action) << bad.address;
        EXPECT_EQ(action.error().code, code) << bad.address;
        EXPECT_EQ(action.error().where, bad.address);
    }
}

TEST(OscSpace, TheStateAsMessages) {
    v1::State state;
    state.set_master_ratio(0.5);
    v1::Light& light = *state.add_lights();
    light.set_name("a b");
    light.set_level_ratio(0.25);
    light.set_pan_rad(std::numbers::pi);
    for (int i = 0; i < 3; ++i) light.add_color_rgb(i);
    for (int i = 0; i < 3; ++i) light.add_position(10 + i);
    const OscValues values = osc_values(state);
    EXPECT_EQ(values.at("/light/a%20b/level"), (std::vector<OscArgument>{0.25F}));
    EXPECT_EQ(values.at("/light/a%20b/pan"), (std::vector<OscArgument>{180.0F}));
    EXPECT_EQ(values.at("/light/a%20b/blue"), (std::vector<OscArgument>{2.0F}));
    EXPECT_EQ(values.at("/master"), (std::vector<OscArgument>{0.5F}));
    std::size_t budget = kOscPatternBudget;
    EXPECT_EQ(osc_select(values, "/light/*/{x,y,z}", budget)->size(), 3u);
    EXPECT_EQ(osc_select(values, "/master", budget)->size(), 1u);
    EXPECT_EQ(osc_select(values, "/*", budget)->size(), 2u) << "master and exposure";
    EXPECT_EQ(osc_select(values, "/l?ght/a%20b/level", budget)->size(), 1u) << "a pattern in the first part only";
    EXPECT_EQ(osc_select(values, "/light/a*/level", budget)->size(), 1u) << "in the second only";
    EXPECT_TRUE(osc_select(values, "/light/*", budget)->empty());
    // Every value can be set by the address under which it is told; what cues do is only told.
    for (const auto& [address, arguments] : values)
        if (!address.starts_with("/cue/")) {
            EXPECT_TRUE(osc_action(message(address, arguments))) << address;
        }
}

}  // namespace
}  // namespace gonio
