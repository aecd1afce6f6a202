// Bad input: one clear error with code, place and value; nothing changes and the picture goes on.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/e2e/daemon_process.h"

namespace gonio::test {
namespace {

using Json = nlohmann::json;

class BadInput : public testing::Test {
protected:
    static void SetUpTestSuite() { daemon = new DaemonProcess({"--size", "96x96"}); }
    static void TearDownTestSuite() {
        delete daemon;
        daemon = nullptr;
    }
    void SetUp() override {
        before = daemon->json({"get"});
        light = before["lights"][0]["name"];
    }
    // After each refusal: same state, and a picture can still be had.
    void TearDown() override {
        EXPECT_TRUE(daemon->alive());
        EXPECT_EQ(daemon->json({"get"}), before);
        EXPECT_EQ(daemon->gonio({"capture", folder.path("still.png"), "--size", "32x32"}).exit_code, 0);
        const unsigned rev = daemon->rev({"set", "exposure", "4.25"});
        EXPECT_GE(daemon->json({"report", "--rev", std::to_string(rev)})["scene_rev"].get<unsigned>(), rev);
        daemon->rev({"set", "exposure", std::to_string(before["exposure_ev100"].get<double>())});
    }
    // Result: what gonio printed on stderr.
    std::string refused(std::vector<std::string> words) {
        const Finished done = daemon->gonio(std::move(words));
        EXPECT_EQ(done.exit_code, 1) << done.out << done.err;
        EXPECT_FALSE(done.err.empty());
        return done.err;
    }
    void expect_names(const std::string& text, const std::vector<std::string>& parts) {
        for (const std::string& part : parts)
            EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' in: " << text;
    }

    static DaemonProcess* daemon;
    TemporaryFolder folder;
    Json before;
    std::string light;
};
DaemonProcess* BadInput::daemon = nullptr;

TEST_F(BadInput, TruncatedGltf) {
    const std::string whole = floor_gltf(0.5);
    refused({"load", "scene", folder.file("cut.gltf", whole.substr(0, whole.size() / 2))});
}

TEST_F(BadInput, MissingScene) {
    expect_names(refused({"load", "scene", folder.path("none.gltf")}), {"not_found", "none.gltf"});
}

TEST_F(BadInput, MissingBuffer) {
    Json gltf = Json::parse(floor_gltf(0.5));
    gltf["buffers"][0]["uri"] = "gone.bin";
    expect_names(refused({"load", "scene", folder.file("hollow.gltf", gltf.dump())}), {"missing_file", "gone.bin"});
}

TEST_F(BadInput, AccessorOutOfBounds) {
    Json gltf = Json::parse(floor_gltf(0.5));
    gltf["accessors"][1]["count"] = 6000000;
    expect_names(refused({"load", "scene", folder.file("far.gltf", gltf.dump())}), {"out_of_bounds", "/accessors/1"});
}

TEST_F(BadInput, IesWithoutTilt) {
    std::string text = isotropic_ies(100);
    text.erase(text.find("TILT=NONE"), 11);
    expect_names(refused({"set", "light", light, "--profile", folder.file("no_tilt.ies", text)}), {"line"});
}

TEST_F(BadInput, EmptyIes) {
    expect_names(refused({"set", "light", light, "--profile", folder.file("bulb", "")}), {"line 1"});
}

TEST_F(BadInput, OddSize) {
    expect_names(refused({"set", "size", "201x100"}), {"width_px", "201", "even"});
}

TEST_F(BadInput, IesWithAWordAmongItsNumbers) {
    std::string text = isotropic_ies(100);
    text.replace(text.find("0 90 180"), 8, "0 ninety 180");
    expect_names(refused({"set", "light", light, "--profile", folder.file("word.ies", text)}), {"line 7", "ninety"});
}

TEST_F(BadInput, UnknownLight) {
    expect_names(refused({"set", "light", "nobody", "--level", "0.5"}), {"not_found", "nobody"});
}

TEST_F(BadInput, NanPosition) {
    expect_names(refused({"set", "light", light, "--position", "0,nan,0"}), {"invalid_argument", "position_m", "nan"});
}

TEST_F(BadInput, UnknownViewTechniqueAndProfile) {
    expect_names(refused({"set", "view", "pretty"}), {"view", "pretty"});
    expect_names(refused({"set", "technique", "magic"}), {"technique", "magic"});
    expect_names(refused({"set", "light", light, "--profile", "no_such_luminaire"}),
                 {"not_found", "no_such_luminaire"});
    expect_names(refused({"meter", "--point", "0,0,0", "--normal", "0,0,0"}), {"meter.normal"});
}

TEST_F(BadInput, OversizedMessage) {
    const std::string big = folder.file("big.ies", isotropic_ies(100) + std::string(5u << 20, ' '));
    const Finished done = daemon->gonio({"set", "light", light, "--profile", big});
    EXPECT_NE(done.exit_code, 0);
    EXPECT_FALSE(done.err.empty());
}

TEST_F(BadInput, AReportOfTheFutureIsRefused) {
    expect_names(refused({"report", "--rev", "4000000000"}), {"report.rev"});
}

TEST(Cli, UsageAndUnreachable) {
    EXPECT_EQ(run_program("gonio", {}).exit_code, 2);
    EXPECT_EQ(run_program("gonio", {"set", "light", "x", "--position", "one,two"}).exit_code, 2);
    EXPECT_EQ(run_program("gonio", {"--server", "http://127.0.0.1:1", "get"}).exit_code, 3);
    EXPECT_EQ(run_program("gonio", {"--help"}).exit_code, 0);
}

}  // namespace
}  // namespace gonio::test
