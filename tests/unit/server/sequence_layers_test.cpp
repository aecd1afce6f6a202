// The layers of a sequence's EXR, path-traced, on a floor that no bounce reaches: closed forms at each pixel.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>

#include "server/assets/exr.h"
#include "server/scene/eye.h"
#include "server/scene/scene.h"
#include "server/sequence/frame_picture.h"
#include "server/sequence/sequence_job.h"
#include "tests/scenes/scenes.h"

namespace gonio::sequence {
namespace {

constexpr int kWidth = 32, kHeight = 18;
constexpr double kCandela = 1000.0, kReflectance = 0.5;

class SequenceLayers : public testing::Test {
protected:
    // A floor seen from above at a slant, beside it the sky; the light 2 m above the middle.
    SequenceLayers()
        : scene(test::floor_scene(8.0, static_cast<float>(kReflectance), test::isotropic(kCandela), {0.0, 2.0, 0.0})) {
        scene.camera = {{0.5, 5.0, 4.0}, {0.0, 0.0, 0.0}, 1.2};
    }
    std::vector<std::byte> bytes(const char* capture, const char* date = "2026-02-28T12:00:00Z") const {
        job::Json json = {{"frames", 3}, {"out", "#.exr"}, {"date", date}};
        json["capture"] = job::Json::parse(capture);
        const Sequence sequence = sequence_of(json);
        Renderers renderers{[]() -> Renderer& { throw std::logic_error("the reference needs no GL"); }, nullptr};
        const auto file = frame_bytes(renderers, scene, sequence, 2, {});
        EXPECT_TRUE(file) << file.error().text();
        return **file;
    }
    ExrFile layers(const char* capture) const {
        char name[] = "/tmp/gonio_layers_XXXXXX.exr";
        ::close(::mkstemps(name, 4));
        const std::vector<std::byte> file = bytes(capture);
        std::ofstream(name, std::ios::binary)
            .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
        auto read = read_exr(name);
        std::remove(name);
        EXPECT_TRUE(read) << read.error().text();
        return *read;
    }
    Scene scene;
};

constexpr const char* kAll =
    R"({"layers":"all","quality":"reference","noise":0.2,"samples_per_pixel":1,"size":"32x18"})";

TEST_F(SequenceLayers, HoldWhatTheyName) {
    const ExrFile file = layers(kAll);
    ASSERT_EQ(file.width_px, kWidth);
    const Eye eye = eye_of(scene.camera, kWidth, kHeight);
    int floor = 0, sky = 0;
    for (int i = 0; i < kWidth * kHeight; ++i) {
        const auto at = [&](const char* channel) {
            return static_cast<double>(file.channels.at(channel)[static_cast<std::size_t>(i)]);
        };
        const glm::dvec3 ray =
            ray_through(eye, (i % kWidth + 0.5) / kWidth * 2 - 1, 1 - (i / kWidth + 0.5) / kHeight * 2);
        const double depth = -eye.position.y / ray.y;  // the ray is one metre deep
        const glm::dvec3 point = eye.position + depth * ray;
        if (ray.y >= 0 || std::abs(point.x) > 4.0 || std::abs(point.z) > 4.0) {
            ++sky;
            EXPECT_EQ(at("depth.Z"), 0);
            EXPECT_EQ(at("id.Y"), 0);
            continue;
        }
        ++floor;
        EXPECT_NEAR(at("depth.Z"), depth, 1e-5 * depth);
        EXPECT_NEAR(at("normal.Y"), 1, 1e-6);
        EXPECT_NEAR(at("normal.X"), 0, 1e-6);
        EXPECT_EQ(at("id.Y"), 1);
        const double squared = point.x * point.x + point.z * point.z + 4.0,
                     lux = kCandela * 2.0 / std::pow(squared, 1.5);
        EXPECT_NEAR(at("illuminance.Y"), lux, 0.002 * lux);
        const double nit = kReflectance * lux / std::numbers::pi;
        for (const char* channel : {"R", "G", "B", "direct.R", "direct.G", "direct.B", "luminance.Y"})
            EXPECT_NEAR(at(channel), nit, 0.002 * nit) << channel;
        EXPECT_NEAR(at("indirect.R"), 0, 1e-6) << "nothing is there that light could come back from";
    }
    EXPECT_GT(floor, 100);
    EXPECT_GT(sky, 20);
}

TEST_F(SequenceLayers, TheHeaderSaysWhatTheyAre) {
    scene.scene_rev = 17;
    const ExrFile file = layers(kAll);
    const auto& texts = file.texts;
    EXPECT_EQ(texts.at("DateTime"), "2026:02:28 12:00:00");
    EXPECT_EQ(texts.at("gonio:revision"), "17");
    EXPECT_EQ(texts.at("gonio:technique"), "default");
    EXPECT_EQ(texts.at("gonio:quality"), "reference");
    EXPECT_EQ(texts.at("gonio:frame"), "2");
    EXPECT_EQ(texts.at("gonio:time_s"), "0.0833333");
    EXPECT_TRUE(texts.at("gonio:error").find("of the mean") != std::string::npos);
    EXPECT_EQ(texts.at("gonio:nodes").substr(0, 2), "1 ");
    EXPECT_NE(texts.at("gonio:units").find("illuminance: lx"), std::string::npos);
}

TEST_F(SequenceLayers, TheSameFrameHasTheSameBytes) {
    EXPECT_EQ(bytes(kAll), bytes(kAll));
    EXPECT_NE(bytes(kAll), bytes(kAll, "2026-02-28T12:00:01Z"));
    constexpr const char* kOne = R"({"view":"illuminance","quality":"reference","noise":0.2,"size":"32x18"})";
    EXPECT_EQ(bytes(kOne), bytes(kOne));
}

TEST_F(SequenceLayers, SomeOfThemAreEnough) {
    const ExrFile file = layers(R"({"layers":["id","luminance"],"quality":"reference","noise":0.4,"size":"32x18"})");
    EXPECT_EQ(file.channels.size(), 2u);
    EXPECT_TRUE(file.channels.contains("id.Y"));
    EXPECT_TRUE(file.channels.contains("luminance.Y"));
    EXPECT_EQ(layers(R"({"layers":["depth"],"size":"32x18"})").channels.size(), 1u) << "no picture is made for it";
}

TEST_F(SequenceLayers, DenoisedLayersAreRefused) {
    job::Json json = {{"frames", 1}, {"out", "#.exr"}};
    json["capture"] = {{"layers", "all"}, {"quality", "reference"}, {"denoise", true}};
    const auto requests = requests_of(sequence_of(json), scene);
    ASSERT_FALSE(requests);
    EXPECT_EQ(requests.error().code, "unsupported");
}

}  // namespace
}  // namespace gonio::sequence
