// Sequences: what their job says, what it makes of a scene at a time, and what of them is known to be complete.
#include "server/sequence/sequence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>

#include "server/assets/assets.h"
#include "server/base/sha256.h"
#include "server/scene/body.h"
#include "server/scene/scene.h"
#include "server/sequence/digest.h"
#include "server/sequence/manifest.h"
#include "server/sequence/sequence_job.h"
#include "server/sequence/timeline.h"

namespace gonio::sequence {
namespace {

namespace fs = std::filesystem;
using job::Json;

Json job_with(const char* more) {
    Json json = {{"frames", 3}, {"out", "f.##.png"}};
    json.update(Json::parse(more));
    return json;
}

Scene cornell() {
    return scene_of(*load_scene("cornell", "", {}, std::size_t{1} << 32));
}

// The values of a light's level at each frame.
std::vector<double> levels(const char* job, Scene scene = cornell()) {
    const Sequence sequence = sequence_of(job_with(job));
    const SceneAccess access;
    Timeline timeline(std::move(scene), sequence, access);
    std::vector<double> found;
    for (int i = 0; i < sequence.frames; ++i) {
        timeline.next();
        found.push_back(timeline.scene().lights.front().level_ratio);
    }
    return found;
}

TEST(Sequences, EasesAreTheirPolynomials) {
    for (const double u : {0.0, 0.25, 0.5, 0.75, 1.0}) {
        EXPECT_DOUBLE_EQ(eased(Ease::linear, u), u);
        EXPECT_DOUBLE_EQ(eased(Ease::in, u), u * u);
        EXPECT_DOUBLE_EQ(eased(Ease::out, u), 1 - eased(Ease::in, 1 - u)) << "in, turned over";
        EXPECT_DOUBLE_EQ(eased(Ease::in_out, u), 1 - eased(Ease::in_out, 1 - u)) << "it is its own mirror image";
        EXPECT_DOUBLE_EQ(eased(Ease::hold, u), u < 1 ? 0 : 1);
    }
    EXPECT_DOUBLE_EQ(eased(Ease::in_out, 0.25), 0.15625);
    EXPECT_NEAR(eased(Ease::in_out, 1e-4) / 1e-4, 0.0, 1e-3) << "it starts at rest";
}

Track track_of_points(std::initializer_list<double> values, bool smooth) {
    Track track;
    track.smooth = smooth;
    double t = 0;
    for (const double value : values) track.keys.push_back({t++, {value}, "", Ease::linear});
    return track;
}

TEST(Sequences, TracksGoThroughTheirKeys) {
    const Track straight = track_of_points({0, 1, 0}, false), smooth = track_of_points({0, 1, 0}, true);
    for (const Track& track : {straight, smooth}) {
        EXPECT_EQ(value_at(track, -5), "0") << "before the first key";
        EXPECT_EQ(value_at(track, 1), "1");
        EXPECT_EQ(value_at(track, 99), "0") << "after the last";
    }
    EXPECT_EQ(value_at(straight, 0.25), "0.25");
    // Hermite with slopes 1 and 0 from 0 to 1: -u³ + u² + u at 0.5.
    EXPECT_EQ(value_at(smooth, 0.5), "0.625");
    const Track line = track_of_points({1, 3, 5, 7}, true);
    for (const double t : {0.25, 1.5, 2.75}) EXPECT_EQ(std::stod(value_at(line, t)), 1 + 2 * t) << "a line stays one";
}

TEST(Sequences, ATracksEaseIsOfAllItsTime) {
    Track track = track_of_points({0, 1, 2}, false);
    track.ease = Ease::in;
    EXPECT_EQ(value_at(track, 1.0), "0.5") << "a quarter of the way at half of the time";
    EXPECT_EQ(value_at(track, 2.0), "2");
}

TEST(Sequences, TextsAndHeldValuesStandUntilTheNextKey) {
    Track track;
    track.keys = {{0, {}, "L201", Ease::linear}, {2, {}, "L202", Ease::linear}};
    EXPECT_EQ(value_at(track, 1.99), "L201");
    EXPECT_EQ(value_at(track, 2), "L202");
    Track held = track_of_points({1, 5}, true);
    held.keys[0].ease = Ease::hold;
    EXPECT_EQ(value_at(held, 0.99), "1");
    EXPECT_EQ(value_at(held, 1), "5");
}

TEST(Sequences, NumbersReadBackAsTheyAre) {
    const Track track = track_of_points({0, 0.1, 1.0 / 3.0}, false);
    EXPECT_EQ(std::stod(value_at(track, 2)), 1.0 / 3.0);
}

TEST(Sequences, RatesNamesAndShards) {
    EXPECT_EQ(parse_rate("24000/1001")->denominator, 1001);
    EXPECT_EQ(parse_rate("25")->numerator, 25);
    EXPECT_EQ(parse_rate("23.976")->per_second(), 23.976);
    for (const char* wrong : {"0", "-24", "1001", "24/0", "x", "1e-9", "23.97601", "nan"})
        EXPECT_FALSE(parse_rate(wrong)) << wrong;
    const Sequence sequence = sequence_of(job_with(R"({"out":"a/f.####.png","first_number":1001})"));
    EXPECT_EQ(frame_name(sequence, 2), "a/f.1003.png");
    EXPECT_EQ(frame_name(sequence_of(job_with(R"({"out":"#.exr"})")), 12), "12.exr");
    std::size_t each = 0;
    for (const char* shard : {"0/3", "1/3", "2/3"})
        for (int i = 0; i < 100; ++i) each += parse_shard(shard)->has(i) ? 1 : 0;
    EXPECT_EQ(each, 100u) << "every frame is of one shard";
    for (const char* wrong : {"3/3", "0/0", "-1/2", "1", "/", "0/10001", "0/2/3"}) EXPECT_FALSE(parse_shard(wrong));
    EXPECT_EQ(sequence_of(Json::parse(R"({"fps":25,"from":1,"to":3,"out":"#.png"})")).frames, 50);
}

TEST(Sequences, WhatIsWrongIsNamedWithPlaceAndValue) {
    struct Case {
        const char *job, *place, *value;
    };
    const Case cases[] = {
        {R"({"frame":3})", "sequence.frame", "3"},
        {R"({"frames":0})", "sequence.frames", "0"},
        {R"({"frames":100001})", "sequence.frames", "100001"},
        {R"({"frames":1.5})", "sequence.frames", "1.5"},
        {R"({"to":4})", "sequence", ""},
        {R"({"fps":"fast"})", "sequence.fps", "\"fast\""},
        {R"({"from":1e9})", "sequence.from", "1000000000.0"},
        {R"({"out":"plain.png"})", "sequence.out", "plain.png"},
        {R"({"out":"#/#.png"})", "sequence.out", "#/#.png"},
        {R"({"out":"../#.png"})", "sequence.out", "../#.png"},
        {R"({"out":"/tmp/#.png"})", "sequence.out", "/tmp/#.png"},
        {R"({"out":".#.png"})", "sequence.out", ".#.png"},
        {R"({"out":"#.gif"})", "sequence.out", "#.gif"},
        {R"({"date":"yesterday"})", "sequence.date", "yesterday"},
        {R"({"video":{"file":"a.avi"}})", "sequence.video.file", "a.avi"},
        {R"({"video":{"file":"a.mp4"},"out":"#.exr"})", "sequence.video.file", "a.mp4"},
        {R"({"video":{"file":"a.mp4","crf":60}})", "sequence.video.crf", "60"},
        {R"({"capture":{"max_seconds":3}})", "sequence.capture.max_seconds", "3"},
        {R"({"capture":{"size":"0x5"}})", "sequence.capture.size", "0x5"},
        {R"({"capture":{"size":"5000x5"}})", "sequence.capture.size", "5000x5"},
        {R"({"capture":{"layers":["depth"]}})", "sequence.capture.layers", "png"},
        {R"({"out":"#.exr","capture":{"layers":["depth","dept"]}})", "sequence.capture.layers[1]", "\"dept\""},
        {R"({"out":"#.exr","capture":{"layers":["id","id"]}})", "sequence.capture.layers[1]", "\"id\""},
        {R"({"tracks":[{"set":[],"keys":[{"t":0,"value":1}]}]})", "sequence.tracks[0].set", "0"},
        {R"({"tracks":[{"set":["master"],"keys":[]}]})", "sequence.tracks[0].keys", "0"},
        {R"({"tracks":[{"set":["master"],"keys":[{"t":1,"value":1},{"t":1,"value":1}]}]})",
         "sequence.tracks[0].keys[1].t", "1"},
        {R"({"tracks":[{"set":["master"],"keys":[{"t":0,"value":1},{"t":1,"value":[1,2]}]}]})",
         "sequence.tracks[0].keys[1].value", "2"},
        {R"({"tracks":[{"set":["master"],"keys":[{"t":0,"value":true}]}]})", "sequence.tracks[0].keys[0].value",
         "true"},
        {R"({"tracks":[{"set":["master"],"curve":"round","keys":[{"t":0,"value":1}]}]})", "sequence.tracks[0].curve",
         "round"},
        {R"({"camera":{"keys":[{"t":0,"eye":[1,2]}]}})", "sequence.camera.keys[0].eye", "[1,2]"},
        {R"({"events":[{"t":"now","set":["cue","go"]}]})", "sequence.events[0].t", "\"now\""},
        {R"({"timecode":{"start":"25:00:00:00"}})", "sequence.timecode.start", "25:00:00:00"},
    };
    for (const Case& expected : cases) {
        try {
            sequence_of(job_with(expected.job));
            ADD_FAILURE() << expected.job;
        } catch (const job::Refused& refused) {
            EXPECT_EQ(refused.place, expected.place) << expected.job;
            EXPECT_EQ(refused.error.value, expected.value) << expected.job;
        }
    }
}

TEST(Sequences, KeysDriveWhatAGonioSetCommandKnows) {
    EXPECT_EQ(levels(R"({"fps":1,"tracks":[{"set":["light","luminaire","--level"],
                        "keys":[{"t":0,"value":0},{"t":2,"value":1}]}]})"),
              (std::vector<double>{0, 0.5, 1}));
    EXPECT_EQ(levels(R"({"fps":1,"tracks":[{"set":["set","light","luminaire","--level"],
                        "keys":[{"t":0,"value":"25%"},{"t":1,"value":"75%"}]}]})"),
              (std::vector<double>{0.25, 0.75, 0.75}));
    const Sequence sequence = sequence_of(job_with(R"({"fps":1,
        "camera":{"curve":"linear","keys":[{"t":0,"eye":[0,1,4],"target":[0,1,0]},{"t":2,"eye":[2,1,4],"fov":60}]},
        "tracks":[{"set":["exposure"],"keys":[{"t":0,"value":-2},{"t":2,"value":6}]},
                  {"set":["view"],"keys":[{"t":0,"value":"beauty"},{"t":1,"value":"illuminance"}]},
                  {"set":["haze","--extinction"],"keys":[{"t":0,"value":0.0},{"t":2,"value":0.1}]}]})"));
    const SceneAccess access;
    Timeline timeline(cornell(), sequence, access);
    timeline.next();
    EXPECT_EQ(timeline.scene().exposure_ev100, -2);
    timeline.next();
    EXPECT_EQ(timeline.scene().camera.eye, glm::dvec3(1, 1, 4));
    EXPECT_NEAR(timeline.scene().camera.fov_rad, std::acos(-1.0) / 3, 1e-12);
    EXPECT_EQ(timeline.scene().exposure_ev100, 2);
    EXPECT_EQ(timeline.scene().view, View::illuminance);
    EXPECT_DOUBLE_EQ(timeline.scene().haze.extinction_per_m, 0.05);
}

// The example of docs/cues.md: from 0 to 1 in 4 s; after 1 s a GO to 0 in 2 s.
TEST(Sequences, CuesRunOnTheClockOfTheFrames) {
    const char* job = R"({"fps":1,"frames":4,"set":[["light","luminaire","--level","1"],["cue","add","1","--up","4"],
        ["light","luminaire","--level","0"],["cue","add","2","--up","2"]],
        "events":[{"t":0,"set":["cue","go"]},{"t":1,"set":["cue","go"]}]})";
    const auto found = levels(job);
    ASSERT_EQ(found.size(), 4u);
    EXPECT_DOUBLE_EQ(found[0], 0.0);
    EXPECT_DOUBLE_EQ(found[1], 0.25);
    EXPECT_DOUBLE_EQ(found[2], 0.125);
    EXPECT_DOUBLE_EQ(found[3], 0.0);
}

TEST(Sequences, CuesWithATimeStartByTimeCode) {
    const auto found = levels(R"({"fps":1,"frames":3,"set":[["light","luminaire","--level","1"],
        ["cue","add","1","--up","2","--timecode","01:00:10:00"],["light","luminaire","--level","0"]],
        "timecode":{"start":"01:00:10:00"}})");
    EXPECT_EQ(found, (std::vector<double>{0, 0.5, 1}));
}

TEST(Sequences, RefusalsInTimeNameTheFrame) {
    const auto place_of = [](const char* job) -> std::string {
        try {
            levels(job);
        } catch (const job::Refused& refused) {
            return refused.place + ": " + refused.error.value;
        }
        return "nothing";
    };
    EXPECT_EQ(place_of(R"({"fps":1,"tracks":[{"set":["light","luminaire","--level"],
                          "keys":[{"t":0,"value":0},{"t":2,"value":4}]}]})"),
              "sequence.tracks[0] at frame 1, 1 s: 2");
    EXPECT_EQ(place_of(R"({"tracks":[{"set":["light","nobody","--level"],"keys":[{"t":0,"value":0}]}]})"),
              "sequence.tracks[0] at frame 0, 0 s: nobody");
    EXPECT_EQ(place_of(R"({"events":[{"t":0,"set":["load","scene","atrium"]}]})"),
              "sequence.events[0].set: load scene atrium");
    EXPECT_EQ(place_of(R"({"events":[{"t":0,"set":["cue","goto","7"]}]})"), "sequence.events[0].set: 7");
    EXPECT_EQ(place_of(R"({"set":[["light"]]})").substr(0, 15), "sequence.set[0]");
}

class Manifests : public testing::Test {
protected:
    void SetUp() override {
        char name[] = "/tmp/gonio_manifest_XXXXXX";
        folder_ = ::mkdtemp(name);
        entry_ = {"a/f.1.png", 1, 0.5, 7, sha256("picture"), 7, "", maker_};
        ASSERT_TRUE(write_file(folder_, entry_.name, "picture"));
        ASSERT_TRUE(write_entry(folder_, entry_));
    }
    void TearDown() override { fs::remove_all(folder_); }
    std::string folder_;
    Maker maker_{"job", "1.0", "avx2", "", "cpu"};
    Entry entry_;
};

// FIPS 180-4's own example.
TEST_F(Manifests, HashesAreSha256) {
    EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST_F(Manifests, AScenesHashIsOfWhatItShows) {
    const std::shared_ptr<const SceneAsset> asset = cornell().asset;
    const std::string hash = sha256_of_asset(*asset);
    EXPECT_EQ(hash, sha256_of_asset(SceneAsset(*asset)));
    const auto changed = [&](const std::function<void(SceneAsset&)>& change) {
        SceneAsset other = *asset;
        change(other);
        return sha256_of_asset(other);
    };
    EXPECT_NE(hash, changed([](SceneAsset& other) { other.meshes[0].vertices[0].position.x += 0.001f; }));
    EXPECT_NE(hash, changed([](SceneAsset& other) { other.materials[0].base_color.g *= 0.99f; }));
    EXPECT_NE(hash, changed([](SceneAsset& other) { other.instances[0].world_from_mesh[3][1] += 0.001; }));
    EXPECT_NE(hash, changed([](SceneAsset& other) { other.lights[0].profile = *builtin_profile("bulb"); }));
    EXPECT_NE(hash, changed([](SceneAsset& other) { other.lights[0].multiplier = 2.0; }));
    EXPECT_EQ(hash, changed([](SceneAsset& other) { other.name = "/another/place.glb"; }));
}

// What of bodies is seen: their meshes, materials and places, and how they turn with their lights.
TEST_F(Manifests, AScenesHashIsOfItsBodies) {
    SceneAsset asset = *cornell().asset;
    const std::string bare = sha256_of_asset(asset);
    Bodies bodies;
    bodies.shown.materials.emplace_back();
    bodies.shown.meshes.emplace_back().vertices.resize(3);
    bodies.shown.meshes[0].indices = {0, 1, 2};
    bodies.shown.instances = {{0, glm::dmat4(1.0), "yoke"}};
    bodies.mounts.emplace_back().joints.emplace_back();
    bodies.parts = {{0, 1}};
    const auto changed = [&](const std::function<void(Bodies&)>& change) {
        auto other = std::make_shared<Bodies>(bodies);
        change(*other);
        asset.bodies = other;
        return sha256_of_asset(asset);
    };
    const std::string hash = changed([](Bodies&) {});
    EXPECT_EQ(hash, changed([](Bodies&) {}));
    EXPECT_NE(hash, bare);
    EXPECT_NE(hash, changed([](Bodies& other) { other.shown.meshes[0].vertices[0].position.x = 0.6f; }));
    EXPECT_NE(hash, changed([](Bodies& other) { other.shown.materials[0].base_color.g *= 0.99f; }));
    EXPECT_NE(hash, changed([](Bodies& other) { other.shown.instances[0].world_from_mesh[0][0] = 2.0; }));
    EXPECT_NE(hash, changed([](Bodies& other) { other.mounts[0].world_from_fixture[3][1] += 0.001; }));
    EXPECT_NE(hash, changed([](Bodies& other) { other.mounts[0].joints[0].point.z += 0.001; }));
    EXPECT_NE(hash, changed([](Bodies& other) { other.mounts[0].aim = {0, 1, 0}; }));
    EXPECT_NE(hash, changed([](Bodies& other) { other.parts[0].joints = 0; }));
}

TEST_F(Manifests, AFileIsCompleteByJobVersionAndBytes) {
    const auto there = complete_entry(folder_, entry_.name, maker_);
    ASSERT_TRUE(there);
    EXPECT_EQ(there->sha256, entry_.sha256);
    EXPECT_EQ(there->scene_rev, 7u);
    EXPECT_FALSE(complete_entry(folder_, entry_.name, {"other job", "1.0", "avx2", "", "cpu"}));
    EXPECT_FALSE(complete_entry(folder_, entry_.name, {"job", "1.1", "avx2", "", "cpu"}));
    EXPECT_TRUE(complete_entry(folder_, entry_.name, {"job", "1.0", "avx512", "gl", "another cpu"}));
    std::ofstream(folder_ + "/a/f.1.png") << "Picture";
    EXPECT_FALSE(complete_entry(folder_, entry_.name, maker_)) << "another byte";
    fs::remove(folder_ + "/a/f.1.png");
    EXPECT_FALSE(complete_entry(folder_, entry_.name, maker_)) << "it is gone";
}

TEST_F(Manifests, ADamagedEntryIsNone) {
    for (const char* text : {"", "{", "[]", "{\"name\":1}", "\xff\xfe"}) {
        std::ofstream(folder_ + "/manifest/a/f.1.png.json") << text;
        EXPECT_FALSE(complete_entry(folder_, entry_.name, maker_)) << text;
    }
}

TEST_F(Manifests, WhatAKilledWriterLeftIsRemoved) {
    char host[256] = {};
    ASSERT_EQ(::gethostname(host, sizeof host - 1), 0);
    const std::string left = folder_ + "/a/.f.2.png.tmp." + host + ".2147483646",
                      mine = part_name(folder_ + "/a/f.2.png"),
                      other = folder_ + "/a/.f.2.png.tmp.elsewhere.2147483646";
    for (const std::string& file : {left, mine, other}) std::ofstream(file) << "half";
    remove_left_parts(folder_, "a/f.#.png");
    EXPECT_FALSE(fs::exists(left));
    EXPECT_TRUE(fs::exists(mine)) << "its process lives";
    EXPECT_TRUE(fs::exists(other)) << "nobody here knows";
    EXPECT_TRUE(fs::exists(folder_ + "/a/f.1.png"));
}

}  // namespace
}  // namespace gonio::sequence
