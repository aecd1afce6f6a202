// The first camera of scenes that have none: in rooms it stands inside, all else is seen whole.
#include "server/trace/first_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/trace/exposure.h"
#include "server/trace/geometry.h"
#include "tests/scenes/scenes.h"
#include "tests/shared_data.h"

namespace gonio::test {
namespace {

enum class Faces : std::uint8_t { inward, outward };

// The faces of a box. ceiling: whether it has a top.
std::vector<Piece> box(const glm::dvec3& low, const glm::dvec3& high, Faces faces, bool ceiling = true) {
    std::vector<Piece> pieces;
    const auto add = [&](glm::dvec3 a, glm::dvec3 b, glm::dvec3 c, glm::dvec3 d) {
        pieces.push_back({faces == Faces::inward ? quad(a, b, c, d) : quad(d, c, b, a), glm::vec3(0.5f)});
    };
    const glm::dvec3 l = low, h = high;
    add({l.x, l.y, h.z}, {h.x, l.y, h.z}, {h.x, l.y, l.z}, {l.x, l.y, l.z});  // floor, seen from above
    if (ceiling) add({l.x, h.y, l.z}, {h.x, h.y, l.z}, {h.x, h.y, h.z}, {l.x, h.y, h.z});
    add({l.x, l.y, l.z}, {h.x, l.y, l.z}, {h.x, h.y, l.z}, {l.x, h.y, l.z});  // seen from +Z
    add({h.x, l.y, h.z}, {l.x, l.y, h.z}, {l.x, h.y, h.z}, {h.x, h.y, h.z});
    add({l.x, l.y, h.z}, {l.x, l.y, l.z}, {l.x, h.y, l.z}, {l.x, h.y, h.z});  // seen from +X
    add({h.x, l.y, l.z}, {h.x, l.y, h.z}, {h.x, h.y, h.z}, {h.x, h.y, l.z});
    return pieces;
}

std::vector<Piece> operator+(std::vector<Piece> some, const std::vector<Piece>& more) {
    some.insert(some.end(), more.begin(), more.end());
    return some;
}

const std::vector<Piece>& room() {
    static const std::vector<Piece> pieces = box({-4, 0, -3}, {4, 3, 3}, Faces::inward);
    return pieces;
}

Scene lit(const std::vector<Piece>& pieces, const glm::dvec3& lamp) {
    return scene_with(pieces, isotropic(100.0), lamp);
}

Scene double_sided(Scene scene) {
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    for (Material& material : asset->materials) material.double_sided = true;
    scene.asset = asset;
    return scene;
}

bool within(const glm::dvec3& at, const glm::dvec3& low, const glm::dvec3& high) {
    return glm::all(glm::greaterThan(at, low)) && glm::all(glm::lessThan(at, high));
}

// How far the camera's middle ray goes, m.
double depth_m(const Scene& scene, const Camera& camera) {
    const auto geometry = trace::geometry_of(scene);
    trace::SurfaceHit hit;
    const glm::vec3 along(glm::normalize(camera.target - camera.eye));
    return geometry->closest(geometry->local(camera.eye), along, 0.0f, true, hit) ? static_cast<double>(hit.distance)
                                                                                  : 1e9;
}

TEST(FirstView, StandsInAClosedRoomAndLooksAlongIt) {
    for (const bool both : {false, true}) {
        Scene scene = lit(room(), {0, 2.5, 0});
        if (both) scene = double_sided(scene);
        const trace::FirstView view = trace::first_view(scene);
        EXPECT_TRUE(view.inside);
        const glm::dvec3 eye = view.camera.eye;
        EXPECT_TRUE(within(eye, {-3.8, 1.4, -2.8}, {3.8, 1.7, 2.8})) << eye.x << " " << eye.y << " " << eye.z;
        EXPECT_GT(depth_m(scene, view.camera), 5.0) << "of 8 m by 6 m";
        EXPECT_EQ(trace::reversed_hint(scene, view.camera, view.inside), "");
        scene.camera = view.camera;
        EXPECT_TRUE(trace::metered_ev100(scene)) << "it is lit";
    }
}

TEST(FirstView, TheSameSceneHasTheSameView) {
    const Camera one = trace::first_view(lit(room(), {1, 2, 1})).camera,
                 two = trace::first_view(lit(room(), {1, 2, 1})).camera;
    EXPECT_EQ(one.eye, two.eye);
    EXPECT_EQ(one.target, two.target);
}

// 3 m high and 1,000 km from the world's origin: all is relative to the geometry's.
TEST(FirstView, StandsInARoomFarAway) {
    const glm::dvec3 far(1e6, 100.0, -1e6);
    const Scene scene = scene_with(room(), isotropic(100.0), {0, 2.5, 0}, orientation_of({}), far);
    const trace::FirstView view = trace::first_view(scene);
    EXPECT_TRUE(view.inside);
    EXPECT_NEAR(view.camera.eye.y, 101.6, 0.01);
}

TEST(FirstView, StandsInARoomWithoutACeiling) {
    const Scene scene = lit(box({-4, 0, -3}, {4, 3, 3}, Faces::inward, false), {0, 2.5, 0});
    const trace::FirstView view = trace::first_view(scene);
    EXPECT_TRUE(view.inside);
    EXPECT_TRUE(within(view.camera.eye, {-4, 1.5, -3}, {4, 1.7, 3}));
    EXPECT_LT(depth_m(scene, view.camera), 12.0) << "it sees a wall";
}

TEST(FirstView, StandsBesideTheFurnitureOfARoom) {
    const Scene scene =
        lit(room() + box({-1.5, 0, -1.5}, {1.5, 0.8, 1.5}, Faces::outward) +
                box({3, 0, -3}, {4, 2.2, -1}, Faces::outward) + box({-4, 0, 1}, {-3, 2.2, 3}, Faces::outward),
            {0, 2.8, 0});
    const trace::FirstView view = trace::first_view(scene);
    EXPECT_TRUE(view.inside);
    const glm::dvec3 eye = view.camera.eye;
    EXPECT_TRUE(within(eye, {-4, 0, -3}, {4, 3, 3}));
    EXPECT_FALSE(within(eye, {3, 0, -3}, {4, 2.2, -1}));
    EXPECT_FALSE(within(eye, {-4, 0, 1}, {-3, 2.2, 3}));
    EXPECT_GT(depth_m(scene, view.camera), 3.0);
}

TEST(FirstView, OfTwoRoomsTakesTheOneThatIsLit) {
    const Scene scene = lit(room() + box({4.2, 0, -3}, {20, 3, 3}, Faces::inward), {0, 2.5, 0});
    const trace::FirstView view = trace::first_view(scene);
    EXPECT_TRUE(view.inside);
    EXPECT_LT(view.camera.eye.x, 4.0);
}

TEST(FirstView, FramesASolidFromOutside) {
    for (const double side_m : {0.2, 4.0}) {
        const Scene scene = lit(box({0, 0, 0}, glm::dvec3(side_m), Faces::outward), {0, 3 * side_m, 3 * side_m});
        const trace::FirstView view = trace::first_view(scene);
        EXPECT_FALSE(view.inside);
        const double distance = glm::distance(view.camera.eye, glm::dvec3(side_m / 2));
        EXPECT_NEAR(distance, 2.6 * std::sqrt(3.0) / 2.0 * side_m, 1e-6) << "as framing() has it";
        EXPECT_EQ(trace::reversed_hint(scene, view.camera, view.inside), "");
    }
    const Scene large = double_sided(lit(box({0, 0, 0}, glm::dvec3(4.0), Faces::outward), {0, 9, 9}));
    EXPECT_FALSE(trace::first_view(large).inside) << "inside are the backs of its faces, and no lamp";
    const Scene small = double_sided(lit(box({0, 0, 0}, glm::dvec3(1.0), Faces::outward), {0, 3, 3}));
    EXPECT_FALSE(trace::first_view(small).inside) << "nobody stands in a box of 1 m";
}

TEST(FirstView, FramesAnObjectOnTheGroundFromItsLitSide) {
    for (const double z : {9.0, -9.0}) {
        const Scene scene =
            lit({Piece{quad({-10, 0, 10}, {10, 0, 10}, {10, 0, -10}, {-10, 0, -10}), glm::vec3(0.5f)},
                 Piece{quad({-9, 0, 0}, {9, 0, 0}, {9, 8, 0}, {-9, 8, 0}), glm::vec3(0.5f)},
                 Piece{quad({9, 0, -0.1}, {-9, 0, -0.1}, {-9, 8, -0.1}, {9, 8, -0.1}), glm::vec3(0.5f)}},
                {0, 3, z});
        const trace::FirstView view = trace::first_view(scene);
        EXPECT_FALSE(view.inside);
        EXPECT_GT(view.camera.eye.z * z, 0.0) << "of a wall from the lamp's side";
        EXPECT_GT(view.camera.eye.y, 0.0);
    }
}

// A room whose faces are turned over: from inside it is empty, which is told by name.
TEST(FirstView, NamesFacesThatAreTurnedOver) {
    Scene scene = lit(box({-4, 0, -3}, {4, 3, 3}, Faces::outward), {0, 2.5, 0});
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    for (Material& material : asset->materials) material.name = "plaster";
    for (Instance& instance : asset->instances) instance.node = "shell";
    scene.asset = asset;
    const trace::FirstView view = trace::first_view(scene);
    EXPECT_TRUE(view.inside) << "a lamp stands in it";
    const std::string hint = trace::reversed_hint(scene, view.camera, view.inside);
    EXPECT_TRUE(hint.starts_with("hint: ")) << hint;
    EXPECT_NE(hint.find("'shell'"), std::string::npos) << hint;
    EXPECT_NE(hint.find("'plaster'"), std::string::npos) << hint;
    EXPECT_NE(hint.find("--backfaces show"), std::string::npos) << hint;
    for (Material& material : asset->materials) material.show_back = true;
    EXPECT_EQ(trace::reversed_hint(scene, view.camera, view.inside), "") << "they are shown";
}

// Looking through the near walls of a room from outside is common, and nothing is wrong.
TEST(FirstView, LookingThroughNearWallsIsNoFault) {
    const Scene scene = lit(room(), {0, 2.5, 0});
    EXPECT_EQ(trace::reversed_hint(scene, framing(scene.asset->bounds), false), "");
}

TEST(FirstView, WithoutSurfacesFramesTheBounds) {
    auto asset = std::make_shared<SceneAsset>();
    asset->materials.emplace_back();
    asset->bounds = {glm::dvec3(-1.0), glm::dvec3(1.0)};
    const Scene scene = scene_of(asset);
    const trace::FirstView view = trace::first_view(scene);
    EXPECT_FALSE(view.inside);
    EXPECT_EQ(view.camera.eye, framing(asset->bounds).eye);
    EXPECT_EQ(trace::reversed_hint(scene, view.camera, false), "");
}

// The file's lights are 10 m up; without them it has nothing.
TEST(FirstView, OfAFileWithoutTrianglesShowsItsLights) {
    const std::string path = testing::TempDir() + "first_view_no_triangles.gltf";
    std::ofstream(path) << R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_lights_punctual"],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":100}]}},"scene":0,
        "scenes":[{"nodes":[0,1]}],"nodes":[
        {"translation":[0,10,0],"extensions":{"KHR_lights_punctual":{"light":0}}},
        {"translation":[4,10,0],"extensions":{"KHR_lights_punctual":{"light":0}}}]})";
    const auto asset = load_scene(path);
    std::filesystem::remove(path);
    ASSERT_TRUE(asset) << asset.error().text();
    ASSERT_EQ((*asset)->lights.size(), 2u);
    EXPECT_EQ((*asset)->bounds.min, glm::dvec3(-1.0, 9.0, -1.0));
    EXPECT_EQ((*asset)->bounds.max, glm::dvec3(5.0, 11.0, 1.0));
    const trace::FirstView view = trace::first_view(scene_of(*asset));
    EXPECT_EQ(view.camera.target, glm::dvec3(2.0, 10.0, 0.0));
    EXPECT_LT(glm::length(view.camera.eye - view.camera.target), 20.0);
}

Scene case_of(const char* file) {
    const auto path = test::shared_data(std::filesystem::path("cases") / file);
    return path ? scene_of(*load_scene(*path)) : Scene{};
}

// The room is 8 m × 8 m × 4 m, its floor at 0, and the file has no camera.
TEST(FirstView, CasesOfUsers) {
    const Scene closed = case_of("57-first-picture-closed-room/room.gltf"),
                reversed = case_of("54-reversed-faces/reversed.gltf");
    if (!closed.asset || !reversed.asset) GTEST_SKIP() << "no shared cases on this machine";
    for (const Scene* scene : {&closed, &reversed}) {
        const trace::FirstView view = trace::first_view(*scene);
        EXPECT_TRUE(view.inside);
        EXPECT_TRUE(within(view.camera.eye, {-4, 1, -4}, {4, 2, 4}));
        EXPECT_EQ(trace::reversed_hint(*scene, view.camera, view.inside).empty(), scene == &closed);
    }
    Scene seen = closed;
    seen.camera = trace::first_view(closed).camera;
    EXPECT_TRUE(trace::metered_ev100(seen));
}

}  // namespace
}  // namespace gonio::test
