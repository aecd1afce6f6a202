// The size of a scene: what --scale moves, and which sizes are said.
#include "protocol/schema/command.pb.h"
#include "server/scene/scene.h"
#include "server/session/command_files.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

class Scale : public GltfFixture {
protected:
    // The triangle of side 1 in a node that stretches it so, with a light and a camera at (3, 4, 5).
    static Json stretched(double side) {
        Json document = triangle();
        document["nodes"][0]["scale"] = {side, side, side};
        document["scenes"][0]["nodes"] = {0, 1, 2};
        document["extensionsUsed"] = {"KHR_lights_punctual"};
        document["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", 7}}};
        document["nodes"].push_back(
            {{"translation", {3, 4, 5}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
        document["cameras"] = {
            {{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}, {"aspectRatio", 1.0}}}}};
        document["nodes"].push_back({{"translation", {3, 4, 5}}, {"camera", 0}});
        return document;
    }
    std::shared_ptr<const SceneAsset> at_scale(const Json& document, double scale) {
        const auto scene = load_scene(write("scene.gltf", document.dump()), "", {.scale = scale});
        EXPECT_TRUE(scene) << scene.error().text();
        return scene ? *scene : std::make_shared<const SceneAsset>();
    }
    // Result: what is said of the size of a scene of this side, before all else; empty for nothing.
    std::string said(double side, double scale = 1.0) {
        const auto scene = at_scale(stretched(side), scale);
        return warns(*scene, "no room") ? scene->warnings.front() : "";
    }
};

void expect_near(const glm::dvec3& a, const glm::dvec3& b) {
    EXPECT_LT(glm::distance(a, b), 1e-12 * (1.0 + glm::length(b))) << a.x << " " << a.y << " " << a.z;
}

TEST_F(Scale, EverythingMovesAboutTheOriginAndCandelaStay) {
    const auto plain = at_scale(stretched(20), 1.0), small = at_scale(stretched(20), 0.25);
    const auto corner = [](const SceneAsset& scene) {
        return glm::dvec3(scene.instances[0].world_from_mesh * glm::dvec4(1, 0, 0, 1));
    };
    expect_near(corner(*plain), {20, 0, 0});
    expect_near(corner(*small), {5, 0, 0});
    expect_near(small->bounds.max, {5, 5, 0});
    expect_near(small->lights[0].position, {0.75, 1, 1.25});
    expect_near(small->cameras[0].eye, {0.75, 1, 1.25});
    expect_near(small->cameras[0].target, plain->cameras[0].target * 0.25);
    EXPECT_EQ(small->cameras[0].fov_rad, plain->cameras[0].fov_rad);
    EXPECT_EQ(small->lights[0].multiplier * small->lights[0].profile->peak_cd, 7.0);
    EXPECT_EQ(small->scale, 0.25);
}

// A unit of the scenes that are built in is a metre.
TEST_F(Scale, BuiltInScenesToo) {
    const auto plain = *load_scene("cornell"), twice = *load_scene("cornell", "", {.scale = 2.0});
    expect_near(twice->bounds.max - twice->bounds.min, 2.0 * (plain->bounds.max - plain->bounds.min));
    expect_near(twice->lights[0].position, 2.0 * plain->lights[0].position);
    EXPECT_EQ(twice->scale, 2.0);
}

TEST_F(Scale, WhatIsNoRoomIsSaidWithWhatMendsIt) {
    for (const double side : {0.11, 1.0, 8.0, 199.0}) EXPECT_EQ(said(side), "") << side;
    const auto says = [&](double side, const std::string& words, double scale = 1.0) {
        EXPECT_NE(said(side, scale).find(words), std::string::npos) << side << ": " << said(side, scale);
    };
    says(812, "is 812 m long, which is no room: --scale 0.01 makes it 8.12 m long, and candela stay");  // centimetres
    says(250, "--scale 0.01 makes it 2.5 m");
    says(6400, "--scale 0.001 makes it 6.4 m");   // millimetres
    says(40000, "--scale 0.001 makes it 40 m");   // a hall in millimetres
    says(0.0725, "--scale 100 makes it 7.25 m");  // metres taken for centimetres
    says(0.0064, "--scale 1000 makes it 6.4 m");  // metres taken for millimetres
    EXPECT_EQ(said(812, 0.01), "");
    EXPECT_EQ(said(6400, 0.01), "") << "64 m: a hall";
    // A factor replaces the one that it was loaded with.
    says(7.25, "is 0.00725 m long, which is no room: --scale 1 makes it 7.25 m", 0.001);
    EXPECT_TRUE(said(1e20).ends_with("is 1e+20 m long, which is no room")) << "no scale that is allowed";
}

TEST_F(Scale, ItsBoundsHaveOneError) {
    write("scene.gltf", triangle().dump());
    for (const double scale : {0.0, -1.0, 0.9e-6, 1.1e6, std::nan("")}) {
        v1::Command command;
        command.mutable_load_scene()->set_file(directory_ / "scene.gltf");
        command.mutable_load_scene()->set_scale(scale);
        const auto refused = read_files(command, {});
        ASSERT_FALSE(refused) << scale;
        EXPECT_EQ(refused.error().code, "invalid_argument");
        EXPECT_EQ(refused.error().where, "load_scene.scale");
        EXPECT_EQ(refused.error().value, print_number(scale));
        EXPECT_EQ(refused.error().message, "must be a number from 1e-06 to 1000000");
    }
    for (const char* built_in : {"cornell", "atrium"}) {
        const auto plain = load_scene(built_in), twice = load_scene(built_in, "", {.scale = 2.0});
        expect_near((*twice)->bounds.max, 2.0 * (*plain)->bounds.max);
        expect_near((*twice)->cameras[0].eye, 2.0 * (*plain)->cameras[0].eye);
    }
}

}  // namespace
}  // namespace gonio
