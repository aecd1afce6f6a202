// The patch: rows, the file, and what a universe of several senders makes of a property.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "protocol/dmx/artnet.h"
#include "protocol/dmx/e131.h"
#include "protocol/dmx/patch.h"
#include "protocol/dmx/patch_toml.h"
#include "protocol/schema/console.pb.h"

namespace gonio {
namespace {

constexpr DmxKey kUniverse{DmxProtocol::sacn, 1};

v1::PatchRow row(unsigned address, std::string property, unsigned bits = 8) {
    v1::PatchRow row;
    row.set_protocol("sacn");
    row.set_universe(1);
    row.set_address(address);
    row.set_property(std::move(property));
    row.set_bits(bits);
    if (!find_property(row.property()) || !find_property(row.property())->of_scene) row.set_target("lamp");
    return row;
}

v1::Patch patch_of(std::initializer_list<v1::PatchRow> rows) {
    v1::Patch patch;
    for (const v1::PatchRow& one : rows) *patch.add_rows() = one;
    return patch;
}

DmxSource sender(std::uint32_t id, std::initializer_list<std::uint8_t> levels, std::uint8_t priority = 100,
                 std::int64_t changed_ns = 0) {
    DmxSource source;
    source.id = id;
    std::copy(levels.begin(), levels.end(), source.levels.begin());
    source.rank.fill(static_cast<std::uint8_t>(priority + 1));
    source.changed_ns = changed_ns;
    return source;
}

// Result: the one value that was read, or NaN.
double only(const std::vector<PropertyValue>& values) {
    return values.size() == 1 ? values[0].value[0] : std::nan("");
}

TEST(Patch, EightAndSixteenBitsSpanTheRange) {
    PatchReader reader(patch_of({row(1, "level"), row(2, "pan", 16), row(4, "color"), row(7, "master", 16)}));
    const auto values = reader.read(kUniverse, {{sender(1, {51, 0x80, 0x00, 0, 255, 51, 0xFF, 0xFF})}});
    ASSERT_EQ(values.size(), 4u);
    EXPECT_DOUBLE_EQ(values[0].value[0], 0.2);
    EXPECT_EQ(values[0].target, "lamp");
    const double pan = 1.5 * std::numbers::pi;
    EXPECT_NEAR(values[1].value[0], -pan + 2 * pan * 32768.0 / 65535.0, 1e-12);
    EXPECT_EQ(values[2].value, (std::array{0.0, 1.0, 0.2}));
    EXPECT_EQ(values[3].property, Property::master);
    EXPECT_DOUBLE_EQ(values[3].value[0], 1.0);
}

TEST(Patch, RangesMayBeTurnedRound) {
    v1::PatchRow one = row(1, "x");
    one.set_low(5);
    one.set_high(-5);
    PatchReader reader(patch_of({one}));
    EXPECT_DOUBLE_EQ(only(reader.read(kUniverse, {{sender(1, {0})}})), 5.0);
    EXPECT_DOUBLE_EQ(only(reader.read(kUniverse, {{sender(1, {255})}})), -5.0);
}

// Parts of a slot's values: a line in each, one value where low is high, and none between them.
TEST(Patch, PartsOfASlotsValuesStandForWhatTheySay) {
    v1::PatchRow one = row(1, "gobo");
    const std::array<double, 4> parts[] = {{0, 9, 0, 0}, {10, 19, 3, 3}, {100, 200, 10, 110}};
    for (const auto& [from, to, low, high] : parts) {
        v1::PatchRange& range = *one.add_ranges();
        range.set_from(static_cast<std::uint32_t>(from));
        range.set_to(static_cast<std::uint32_t>(to));
        range.set_low(low);
        range.set_high(high);
    }
    v1::SetPatch set;
    *set.add_rows() = one;
    ASSERT_TRUE(check_patch(set)) << check_patch(set).error().text();
    PatchReader reader(patch_of({one}));
    const auto at = [&](std::uint8_t value) { return reader.read(kUniverse, {{sender(1, {value})}}); };
    EXPECT_DOUBLE_EQ(only(at(9)), 0.0);
    EXPECT_DOUBLE_EQ(only(at(10)), 3.0);
    EXPECT_TRUE(at(20).empty());
    EXPECT_DOUBLE_EQ(only(at(100)), 10.0);
    EXPECT_DOUBLE_EQ(only(at(150)), 60.0);
    EXPECT_DOUBLE_EQ(only(at(200)), 110.0);
    EXPECT_TRUE(at(201).empty());
}

TEST(Patch, ARowSpeaksWhenItsSlotsChange) {
    PatchReader reader(patch_of({row(1, "level"), row(2, "roll")}));
    EXPECT_EQ(reader.read(kUniverse, {{sender(1, {10, 20})}}).size(), 2u);
    EXPECT_TRUE(reader.read(kUniverse, {{sender(1, {10, 20, 99})}}).empty());
    EXPECT_EQ(reader.read(kUniverse, {{sender(1, {10, 21})}}).size(), 1u);
    EXPECT_TRUE(reader.read(kUniverse, {}).empty()) << "all senders lost: the last look stays";
    EXPECT_TRUE(reader.read(kUniverse, {{sender(2, {10, 21})}}).empty());
    EXPECT_TRUE(reader.read({DmxProtocol::artnet, 1}, {{sender(3, {1, 2})}}).empty()) << "another protocol's universe";
}

TEST(Patch, LevelsTakeTheHighestOfAll16Bits) {
    PatchReader reader(patch_of({row(1, "level", 16)}));
    // Slot by slot the highest would be 0x02FF, which nobody sends.
    EXPECT_DOUBLE_EQ(only(reader.read(kUniverse, {{sender(1, {0x01, 0xFF}), sender(2, {0x02, 0x00})}})),
                     0x0200 / 65535.0);
}

// One light's level from sACN and from Art-Net: the highest of those that somebody sends, as within a universe.
TEST(Patch, LevelsTakeTheHighestOfAllProtocols) {
    v1::PatchRow artnet = row(1, "level");
    artnet.set_protocol("artnet");
    artnet.set_universe(0);
    const DmxKey other{DmxProtocol::artnet, 0};
    PatchReader reader(patch_of({row(1, "level"), row(2, "pan"), artnet}));
    EXPECT_EQ(reader.read(kUniverse, {{sender(1, {102, 0})}}).size(), 2u);
    EXPECT_DOUBLE_EQ(only(reader.read(other, {{sender(2, {204})}})), 0.8);
    EXPECT_TRUE(reader.read(kUniverse, {{sender(1, {153, 0})}}).empty()) << "below the other";
    EXPECT_DOUBLE_EQ(only(reader.read(other, {{sender(2, {51})}})), 0.6) << "sACN's is the highest now";
    EXPECT_TRUE(reader.read(other, {}).empty()) << "its sender has gone: the highest is as it was";
    EXPECT_TRUE(reader.read(kUniverse, {}).empty()) << "all have: the last look stays";
    EXPECT_DOUBLE_EQ(only(reader.read(other, {{sender(2, {51})}})), 0.2);
    // Unless the patch says otherwise.
    v1::PatchRow last = row(1, "level");
    last.set_merge("latest");
    artnet.set_merge("latest");
    PatchReader latest(patch_of({last, artnet}));
    EXPECT_DOUBLE_EQ(only(latest.read(kUniverse, {{sender(1, {255})}})), 1.0);
    EXPECT_DOUBLE_EQ(only(latest.read(other, {{sender(2, {51})}})), 0.2);
    v1::SetPatch bad;
    *bad.add_rows() = row(1, "pan");
    bad.mutable_rows(0)->set_merge("highest");
    EXPECT_EQ(check_patch(bad).error().where, "set_patch.rows[0].merge");
    const auto file = read_patch_toml(
        "[[patch]]\nsacn = 1\naddress = 1\ntarget = \"lamp\"\nmerge = \"latest\"\nchannels = [\"level\", \"pan\"]\n");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_EQ(file->rows(0).merge(), "latest");
    EXPECT_FALSE(read_patch_toml(
        "[[patch]]\nsacn = 1\naddress = 1\ntarget = \"l\"\nmerge = \"most\"\nchannels = [\"level\"]\n"));
}

// Emitters of a lamp add up, dimmers one below the other are factors; also of one universe.
TEST(Patch, RowsMayBeTermsOrFactors) {
    const auto merged = [](unsigned address, const char* property, const char* merge, double high) {
        v1::PatchRow one = row(address, property);
        one.set_merge(merge);
        one.set_high(high);
        return one;
    };
    PatchReader sum(patch_of({merged(1, "red", "sum", 0.5), merged(2, "red", "sum", 0.25), row(3, "green")}));
    auto said = sum.read(kUniverse, {{sender(1, {255, 255, 0})}});
    ASSERT_EQ(said.size(), 2u);
    EXPECT_DOUBLE_EQ(said[1].value[0], 0.75);
    EXPECT_DOUBLE_EQ(only(sum.read(kUniverse, {{sender(1, {0, 255, 0})}})), 0.25);
    EXPECT_TRUE(sum.read(kUniverse, {{sender(1, {0, 255, 0})}}).empty());
    PatchReader product(patch_of({merged(1, "level", "product", 1), merged(2, "level", "product", 1)}));
    EXPECT_DOUBLE_EQ(only(product.read(kUniverse, {{sender(1, {51, 204})}})), 0.16);
    EXPECT_DOUBLE_EQ(only(product.read(kUniverse, {{sender(1, {0, 204})}})), 0.0);
    v1::PatchRow other = merged(1, "level", "product", 1);
    other.set_universe(7);
    PatchReader two(patch_of({merged(1, "level", "product", 1), other}));
    const DmxKey seven{DmxProtocol::sacn, 7};
    EXPECT_DOUBLE_EQ(only(two.read(kUniverse, {{sender(1, {51})}})), 0.2);
    EXPECT_DOUBLE_EQ(only(two.read(seven, {{sender(2, {204})}})), 0.16);
    EXPECT_TRUE(two.read(kUniverse, {}).empty()) << "its sender has gone: it counts as it was";
    EXPECT_DOUBLE_EQ(only(two.read(seven, {{sender(2, {102})}})), 0.08);
    PatchReader most(patch_of({merged(1, "level", "sum", 1), merged(2, "level", "sum", 1)}));
    EXPECT_DOUBLE_EQ(only(most.read(kUniverse, {{sender(1, {255, 255})}})), 1.0) << "what the property takes";
    v1::SetPatch bad;
    *bad.add_rows() = row(1, "color");
    bad.mutable_rows(0)->set_merge("sum");
    EXPECT_EQ(check_patch(bad).error().where, "set_patch.rows[0].merge");
    const auto file =
        read_patch_toml("[[patch]]\nsacn = 1\naddress = 1\ntarget = \"lamp\"\nmerge = \"sum\"\nchannels = [\"red\"]\n");
    ASSERT_TRUE(file) << file.error().text();
    EXPECT_EQ(file->rows(0).merge(), "sum");
}

TEST(Patch, OtherPropertiesFollowWhoChangedLast) {
    PatchReader reader(patch_of({row(1, "red", 16)}));
    const auto read = [&](std::initializer_list<std::uint8_t> a, std::int64_t a_ns,
                          std::initializer_list<std::uint8_t> b, std::int64_t b_ns) {
        return only(reader.read(kUniverse, {{sender(1, a, 100, a_ns), sender(2, b, 100, b_ns)}})) * 65535.0;
    };
    EXPECT_NEAR(read({0x80, 0x01}, 10, {0x10, 0x00}, 5), 0x8001, 1e-6);
    EXPECT_NEAR(read({0x80, 0x01}, 10, {0x10, 0x02}, 20), 0x1002, 1e-6) << "lower, but moved last";
    // A change of other slots makes no claim.
    EXPECT_TRUE(std::isnan(read({0x80, 0x01}, 30, {0x10, 0x02}, 20)));
    // The holder leaves: the other one goes on.
    EXPECT_NEAR(only(reader.read(kUniverse, {{sender(1, {0x80, 0x01}, 100, 30)}})) * 65535.0, 0x8001, 1e-6);
}

TEST(Patch, PrioritiesArePerSlot) {
    PatchReader reader(patch_of({row(1, "level"), row(2, "level", 16)}));
    DmxSource low = sender(1, {200, 1, 0}, 50), high = sender(2, {10, 9, 9}, 150);
    high.rank[2] = 0;  // it does not control the fine byte of the second row
    const auto values = reader.read(kUniverse, {{low, high}});
    ASSERT_EQ(values.size(), 2u);
    EXPECT_DOUBLE_EQ(values[0].value[0], 10 / 255.0);
    EXPECT_DOUBLE_EQ(values[1].value[0], 256 / 65535.0) << "a sender must control all slots of a row";
}

TEST(Patch, AProfileIsChosenFromAList) {
    v1::PatchRow one = row(1, "profile");
    for (const char* name : {"flood", "bulb", "street"}) one.add_profiles(name);
    v1::SetPatch set;
    *set.add_rows() = one;
    ASSERT_TRUE(check_patch(set)) << check_patch(set).error().text();
    PatchReader reader(patch_of({one}));
    EXPECT_EQ(reader.read(kUniverse, {{sender(1, {85})}}).at(0).name, "flood");
    EXPECT_EQ(reader.read(kUniverse, {{sender(1, {86})}}).at(0).name, "bulb");
    EXPECT_EQ(reader.read(kUniverse, {{sender(1, {255})}}).at(0).name, "street");
}

TEST(Patch, AGelIsChosenFromAListAndNoneIsOne) {
    const auto patch = read_patch_toml(
        "[[patch]]\nsacn = 1\naddress = 1\ntarget = \"spot\"\nchannels = [\"gel\", \"cct:16\"]\ngels = [\"\", "
        "\"L201\"]\n");
    ASSERT_TRUE(patch) << patch.error().text();
    PatchReader reader(patch_of({patch->rows(0), patch->rows(1)}));
    const auto low = reader.read(kUniverse, {{sender(1, {127, 0, 0})}});
    EXPECT_EQ(low.at(0).name, "");
    EXPECT_EQ(low.at(0).property, Property::gel);
    EXPECT_DOUBLE_EQ(low.at(1).value[0], 2000) << "K";
    const auto high = reader.read(kUniverse, {{sender(1, {128, 255, 255})}});
    EXPECT_EQ(high.at(0).name, "L201");
    EXPECT_DOUBLE_EQ(high.at(1).value[0], 10'000);
    v1::Patch written;
    *written.mutable_rows() = patch->rows();
    EXPECT_EQ(read_patch_toml(write_patch_toml(written))->DebugString(), patch->DebugString());
}

// A sweep over a wheel of three must not read a file for each of its 256 steps.
TEST(Patch, AProfileSpeaksOnceWhileItIsTheSame) {
    v1::PatchRow one = row(1, "profile", 16);
    for (const char* name : {"flood", "bulb", "street"}) one.add_profiles(name);
    PatchReader reader(patch_of({one}));
    std::vector<std::string> said;
    for (unsigned step = 0; step < 65536; step += 32)
        for (const PropertyValue& value : reader.read(
                 kUniverse, {{sender(1, {static_cast<std::uint8_t>(step >> 8), static_cast<std::uint8_t>(step)})}}))
            said.push_back(value.name);
    EXPECT_EQ(said, (std::vector<std::string>{"flood", "bulb", "street"}));
}

TEST(Patch, WhatIsForgottenIsSaidAgain) {
    v1::PatchRow other = row(2, "level");
    other.set_target("other");
    PatchReader reader(patch_of({row(1, "level"), other, row(3, "master")}));
    const DmxUniverse universe{{sender(1, {10, 20, 30})}};
    EXPECT_EQ(reader.read(kUniverse, universe).size(), 3u);
    EXPECT_TRUE(reader.read(kUniverse, universe).empty());
    reader.forget("other");
    const auto again = reader.read(kUniverse, universe);
    ASSERT_EQ(again.size(), 1u);
    EXPECT_EQ(again[0].target, "other");
    reader.forget(Property::master);
    EXPECT_EQ(reader.read(kUniverse, universe).at(0).property, Property::master);
}

TEST(Patch, BeyondWhatCanBeJoinedOrToldIsWarnedOf) {
    v1::Patch patch;
    for (unsigned i = 0; i < kMaxJoinedUniverses; ++i) {
        *patch.add_rows() = row(1, "level");
        patch.mutable_rows(static_cast<int>(i))->set_universe(i + 1);
    }
    for (unsigned i = 0; i < 4 * kMaxArtPages; ++i) {
        v1::PatchRow& one = *patch.add_rows() = row(1, "level");
        one.set_protocol("artnet");
        one.set_universe(i);
    }
    EXPECT_TRUE(patch_limits(patch).empty());
    *patch.add_rows() = row(1, "level");
    patch.mutable_rows(patch.rows_size() - 1)->set_universe(9000);
    *patch.add_rows() = patch.rows(patch.rows_size() - 2);
    patch.mutable_rows(patch.rows_size() - 1)->set_universe(30000);
    const auto warnings = patch_limits(patch);
    ASSERT_EQ(warnings.size(), 2u);
    EXPECT_NE(warnings[0].find("513 sACN"), std::string::npos) << warnings[0];
    EXPECT_NE(warnings[0].find("9000"), std::string::npos) << warnings[0];
    EXPECT_NE(warnings[1].find("30000"), std::string::npos) << warnings[1];
}

TEST(Patch, TheDefaultIsOneSlotALightInBothProtocols) {
    const std::string names[] = {"a", "b"};
    const v1::Patch patch = default_patch(names);
    ASSERT_EQ(patch.rows_size(), 4);
    EXPECT_TRUE(patch.is_default());
    EXPECT_EQ(patch.rows(1).target(), "b");
    EXPECT_EQ(patch.rows(1).address(), 2u);
    EXPECT_EQ(universes_of(patch), (std::vector<DmxKey>{{DmxProtocol::sacn, 1}, {DmxProtocol::artnet, 0}}));
    v1::SetPatch set;
    *set.mutable_rows() = patch.rows();
    EXPECT_TRUE(check_patch(set));
}

TEST(Patch, BadRowsAreRefusedWithTheirField) {
    const auto changed = [](auto change) {
        v1::PatchRow one = row(1, "level");
        change(one);
        return one;
    };
    const std::pair<v1::PatchRow, const char*> cases[] = {
        {changed([](auto& r) { r.set_protocol("dmx"); }), "protocol"},
        {changed([](auto& r) { r.set_universe(0); }), "universe"},
        {changed([](auto& r) { r.set_universe(64000); }), "universe"},
        {changed([](auto& r) { r.set_protocol("artnet"), r.set_universe(32768); }), "universe"},
        {changed([](auto& r) { r.set_address(0); }), "address"},
        {changed([](auto& r) { r.set_address(513); }), "address"},
        {changed([](auto& r) { r.set_address(512), r.set_bits(16); }), "address"},
        {changed([](auto& r) { r.set_address(511), r.set_property("color"); }), "address"},
        {changed([](auto& r) { r.set_bits(12); }), "bits"},
        {changed([](auto& r) { r.set_property("shine"); }), "property"},
        {changed([](auto& r) { r.set_target(""); }), "target"},
        {changed([](auto& r) { r.set_property("master"); }), "target"},
        {changed([](auto& r) { r.set_target(std::string(200, 'x')); }), "target"},
        {changed([](auto& r) { r.set_property("x"); }), "low"},
        {changed([](auto& r) { r.set_low(std::nan("")); }), "low"},
        {changed([](auto& r) { r.set_high(1e9); }), "high"},
        {changed([](auto& r) { r.set_property("profile"); }), "profiles"},
        {changed([](auto& r) { r.add_profiles("flood"); }), "profiles"},
        {changed([](auto& r) { r.set_property("profile"), r.add_profiles("no such"); }), "profiles"},
    };
    const auto ranges_of = [](std::initializer_list<std::array<double, 4>> parts, const char* property) {
        v1::PatchRow one = row(1, property);
        for (const auto& part : parts) {
            v1::PatchRange& range = *one.add_ranges();
            range.set_from(static_cast<std::uint32_t>(part[0]));
            range.set_to(static_cast<std::uint32_t>(part[1]));
            range.set_low(part[2]);
            range.set_high(part[3]);
        }
        return one;
    };
    std::vector<std::pair<v1::PatchRow, const char*>> all(std::begin(cases), std::end(cases));
    all.emplace_back(ranges_of({{0, 9, 0, 1}, {9, 20, 1, 1}}, "level"), "ranges");  // one begins in the other
    all.emplace_back(ranges_of({{9, 8, 0, 1}}, "level"), "ranges");                 // it ends before it begins
    all.emplace_back(ranges_of({{0, 256, 0, 1}}, "level"), "ranges");               // beyond 8 bits
    all.emplace_back(ranges_of({{0, 9, 0, 1.5}}, "level"), "ranges");               // beyond what a level takes
    all.emplace_back(ranges_of({{0, 9, 0, std::nan("")}}, "level"), "ranges");
    all.emplace_back(ranges_of({{0, 9, 0, 1}}, "color"), "ranges");  // three numbers
    v1::PatchRow both = ranges_of({{0, 9, 0, 1}}, "level");
    both.set_low(0.0);
    all.emplace_back(both, "ranges");
    for (const auto& [bad, field] : all) {
        v1::SetPatch set;
        *set.add_rows() = row(1, "level");
        *set.add_rows() = bad;
        const auto checked = check_patch(set);
        ASSERT_FALSE(checked) << field;
        EXPECT_EQ(checked.error().code, "invalid_argument");
        EXPECT_EQ(checked.error().where, std::string("set_patch.rows[1].") + field);
    }
    v1::SetPatch set;
    for (std::size_t i = 0; i <= kMaxPatchRows; ++i) *set.add_rows() = row(1, "level");
    EXPECT_EQ(check_patch(set).error().code, "too_large");
    set.set_use_default(true);
    EXPECT_EQ(check_patch(set).error().code, "conflict");
}

constexpr const char* kFile = R"(# the front truss
[[patch]]
sacn = 2
address = 11
target = "spot \"A\""
channels = ["level:16", "-", "pan:16", "tilt", "color", "profile"]
range.pan = [-180, 180]
profiles = ["flood", "bulb"]

[[patch]]
artnet = 0
address = 512
channels = ["master"]
)";

TEST(PatchFile, AFixtureIsItsChannelsInARow) {
    const auto patch = read_patch_toml(kFile);
    ASSERT_TRUE(patch) << patch.error().text();
    ASSERT_EQ(patch->rows_size(), 6);
    const unsigned addresses[] = {11, 14, 16, 17, 20, 512};
    for (int i = 0; i < 6; ++i) EXPECT_EQ(patch->rows(i).address(), addresses[i]) << i;
    EXPECT_EQ(patch->rows(0).target(), "spot \"A\"");
    EXPECT_EQ(patch->rows(0).bits(), 16u);
    EXPECT_FALSE(patch->rows(0).has_low());
    EXPECT_DOUBLE_EQ(patch->rows(1).low(), -std::numbers::pi);
    EXPECT_EQ(patch->rows(4).profiles(1), "bulb");
    EXPECT_EQ(patch->rows(5).protocol(), "artnet");
    EXPECT_EQ(patch->rows(5).universe(), 0u);
    EXPECT_EQ(patch->rows(5).target(), "");
    v1::Patch written;
    *written.mutable_rows() = patch->rows();
    const auto again = read_patch_toml(write_patch_toml(written));
    ASSERT_TRUE(again) << again.error().text() << write_patch_toml(written);
    EXPECT_EQ(again->DebugString(), patch->DebugString());
    EXPECT_EQ(read_patch_toml("")->rows_size(), 0);
}

TEST(PatchFile, PartsOfASlotAreInTheUnitThatPeopleWrite) {
    const auto patch = read_patch_toml(
        "[[patch]]\nsacn = 1\naddress = 1\ntarget = \"spot\"\nchannels = [\"shutter\", \"zoom:16\"]\n"
        "ranges.shutter = [[0, 31, 0, 0], [32, 255, 1, 1]]\nranges.zoom = [[0, 65535, 5, 60]]\n");
    ASSERT_TRUE(patch) << patch.error().text();
    ASSERT_EQ(patch->rows_size(), 2);
    ASSERT_EQ(patch->rows(0).ranges_size(), 2);
    EXPECT_EQ(patch->rows(0).ranges(1).from(), 32u);
    EXPECT_EQ(patch->rows(0).ranges(1).high(), 1.0);
    ASSERT_EQ(patch->rows(1).ranges_size(), 1);
    EXPECT_NEAR(patch->rows(1).ranges(0).high(), std::numbers::pi / 3, 1e-12) << "60 degrees";
    v1::Patch written;
    *written.mutable_rows() = patch->rows();
    const auto again = read_patch_toml(write_patch_toml(written));
    ASSERT_TRUE(again) << again.error().text() << write_patch_toml(written);
    EXPECT_EQ(again->DebugString(), patch->DebugString());
}

TEST(PatchFile, NamesMayHoldAnyCharacters) {
    const auto patch = read_patch_toml(
        "# \xcf\x8a\n[[patch]]\nsacn = 1\naddress = 1\ntarget = \"L\xc3\xa9on \\\"\xf0\x9f\x92\xa1\\\" 'x'\"\nchannels "
        "= [\"level\"]");
    ASSERT_TRUE(patch) << patch.error().text();
    EXPECT_EQ(patch->rows(0).target(), "L\xc3\xa9on \"\xf0\x9f\x92\xa1\" 'x'");
    v1::Patch written;
    *written.mutable_rows() = patch->rows();
    const auto again = read_patch_toml(write_patch_toml(written));
    ASSERT_TRUE(again) << write_patch_toml(written);
    EXPECT_EQ(again->rows(0).target(), patch->rows(0).target());
}

// toml++ recurses as deep as keys and values nest: it must not see these.
TEST(PatchFile, DeepNestingIsRefusedBeforeItIsParsed) {
    const auto many = [](std::string text, int times) {
        std::string result;
        for (int i = 0; i < times; ++i) result += text;
        return result;
    };
    const std::string head = "[[patch]]\nsacn = 1\naddress = 1\ntarget = \"a\"\nchannels = [\"level\"]\n";
    for (const std::string& deep :
         {many("a.", 200'000) + "a = 1", "[" + many("a.", 200'000) + "a]", many("\"a\" . ", 100'000) + "a = 1",
          "x = " + many("[", 200'000), "x = " + many("{a.a = ", 100'000), "# c\n" + many("a.", 200'000),
          head + "range." + many("a.", 200'000) + "a = [0, 1]"}) {
        const auto patch = read_patch_toml(deep);
        ASSERT_FALSE(patch);
        EXPECT_EQ(patch.error().code, "bad_patch");
        EXPECT_TRUE(patch.error().where.starts_with("line ")) << patch.error().where;
    }
    std::string text = head +
                       "range = { level = [0.125, 0.5], pan = [-1.5, 1.5], tilt = [0.5, 1.5], roll = [0.5, 1.5], "
                       "x = [0.5, 1.5] } # a.b.c.d.e.f.g.h.i.j.k\n";
    const auto patch = read_patch_toml(text);
    ASSERT_TRUE(patch) << patch.error().text();
    EXPECT_DOUBLE_EQ(patch->rows(0).low(), 0.125);
}

TEST(PatchFile, ErrorsNameLineAndColumn) {
    const std::string head = "[[patch]]\nsacn = 1\naddress = 1\ntarget = \"a\"\n";
    const std::pair<std::string, const char*> cases[] = {
        {"[[patch]", "line 1"},
        {"[[patch]]\n[\x1bpatch]]", "line 2 column 2"},
        {"x = \"\xcf\x8a\" # \xcf\x8a\n\xcf\x8a", "line 2 column 1"},
        {"x = '\xcf\x8a'", "line 1 column 6"},
        {"x = \"\xff\"", "line 1 column 6"},
        {"patch = 3", "line 1"},
        {"other = 3", "line 1"},
        {"[[patch]]\naddress = 1\nchannels = [\"level\"]", "line 1"},
        {"[[patch]]\nsacn = 0\naddress = 1\nchannels = [\"level\"]", "line 2"},
        {"[[patch]]\nsacn = 1\nartnet = 1\naddress = 1\nchannels = [\"level\"]", "line 1"},
        {"[[patch]]\nsacn = \"one\"\naddress = 1\nchannels = [\"level\"]", "line 2"},
        {"[[patch]]\nsacn = 1\naddress = 513\nchannels = [\"level\"]", "line 3"},
        {head + "channels = \"level\"", "line 1"},
        {head + "channels = [\"level\", 5]", "line 5"},
        {head + "channels = [\"shine\"]", "line 5"},
        {head + "channels = [\"level:12\"]", "line 5"},
        {head + "channels = [\"x\"]", "line 5"},
        {head + "channels = [\"level\"]\nspeed = 4", "line 6"},
        {head + "channels = [\"level\"]\nrange.shine = [0, 1]", "line 6"},
        {head + "channels = [\"level\"]\nrange.level = [0]", "line 6"},
        {head + "channels = [\"level\"]\nrange.level = [0, inf]", "line 6"},
        {head + "channels = [\"level\"]\nranges = 4", "line 6"},
        {head + "channels = [\"level\"]\nranges.shine = [[0, 1, 0, 1]]", "line 6"},
        {head + "channels = [\"level\"]\nranges.level = [[0, 1, 0]]", "line 6"},
        {head + "channels = [\"level\"]\nranges.level = [[0, 1, 0, true]]", "line 6"},
        {head + "channels = [\"level\"]\nranges.level = [[0, 70000, 0, 1]]", "line 6"},
        {head + "channels = [\"profile\"]", "line 5"},
        {head + "channels = [\"profile\"]\nprofiles = [\"nobody\"]", "line 5"},
    };
    for (const auto& [text, line] : cases) {
        const auto patch = read_patch_toml(text);
        ASSERT_FALSE(patch) << text;
        EXPECT_EQ(patch.error().code, "bad_patch") << text;
        EXPECT_TRUE(patch.error().where.starts_with(line)) << text << "\n" << patch.error().where;
    }
    EXPECT_EQ(read_patch_toml(std::string(2u << 20, '#')).error().code, "too_large");
    std::string many;
    for (int i = 0; i < 9; ++i) {
        many += "[[patch]]\nsacn = " + std::to_string(i + 1) + "\naddress = 1\ntarget = \"a\"\nchannels = [";
        for (int k = 0; k < 500; ++k) many += "\"level\",";
        many += "]\n";
    }
    EXPECT_EQ(read_patch_toml(many).error().code, "too_large");
}

}  // namespace
}  // namespace gonio
