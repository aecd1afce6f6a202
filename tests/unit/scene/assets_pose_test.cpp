// glTF import: skins, morph targets and hidden nodes, at the pose of the file. Expected places are computed by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

constexpr const char* kPrimitive = "/meshes/0/primitives/0";

class AssetsPose : public GltfFixture {
protected:
    // The triangle on node 0, far away, with joints as further nodes. weights: four a vertex.
    Json skinned(const std::vector<float>& weights, const std::string& joints, const Json& nodes) {
        Json document = triangle();
        document["nodes"][0]["translation"] = {100, 100, 100};
        document["nodes"][0]["scale"] = {50, 50, 50};
        document["nodes"][0]["skin"] = 0;
        for (const Json& node : nodes) document["nodes"].push_back(node);
        document["skins"] = Json::array({Json{{"joints", Json::array()}}});
        for (std::size_t i = 0; i < nodes.size(); ++i) document["skins"][0]["joints"].push_back(i + 1);
        add_set(document, 0, weights, joints);
        return document;
    }
    void add_set(Json& document, int set, const std::vector<float>& weights, const std::string& joints) {
        Json& attributes = document["meshes"][0]["primitives"][0]["attributes"];
        attributes["JOINTS_" + std::to_string(set)] = add_accessor(document, joints, 5121, 3, "VEC4");
        attributes["WEIGHTS_" + std::to_string(set)] = add_accessor(document, bytes_of(weights), 5126, 3, "VEC4");
    }
    void add_normals(Json& document, const std::vector<float>& normals) {
        document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
            add_accessor(document, bytes_of(normals), 5126, 3, "VEC3");
    }
    // Result: index of the target.
    std::size_t add_target(Json& document, const std::vector<float>& moves, const char* attribute = "POSITION") {
        const int accessor = add_accessor(document, bytes_of(moves), 5126, 3, "VEC3");
        Json& targets = document["meshes"][0]["primitives"][0]["targets"];
        targets.push_back({{attribute, accessor}});
        return targets.size() - 1;
    }
    // Corners of the scene's triangles in the world, in the order of the indices.
    static std::vector<glm::dvec3> corners(const SceneAsset& scene) {
        std::vector<glm::dvec3> found;
        for (const Instance& instance : scene.instances) {
            const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
            for (const std::uint32_t index : mesh.indices)
                found.emplace_back(instance.world_from_mesh * glm::dvec4(mesh.vertices[index].position, 1.0));
        }
        return found;
    }
    static void expect_corners(const SceneAsset& scene, const std::vector<glm::dvec3>& expected,
                               double tolerance_m = 1e-6) {
        const auto found = corners(scene);
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t i = 0; i < found.size(); ++i)
            EXPECT_LT(glm::length(found[i] - expected[i]), tolerance_m)
                << i << ": " << found[i].x << " " << found[i].y << " " << found[i].z;
    }
    void refused(const Json& document, const std::string& code, const std::string& where) {
        const auto result = load(document);
        ASSERT_FALSE(result) << code << " at " << where;
        EXPECT_EQ(result.error().code, code) << result.error().text();
        EXPECT_EQ(result.error().where, where) << result.error().text();
    }
};

const std::string kFirst(12, '\0');  // every vertex has joint 0, four times
const std::vector<float> kWhole = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};

// (0,0,0) by the first joint, (1,0,0) by the second, which is turned by 90 degrees about Z, (0,1,0) by both.
Json two_joints() {
    return Json::parse(R"([{"translation": [1, 0, 0]},
        {"translation": [0, 2, 0], "rotation": [0, 0, 0.70710678118654752, 0.70710678118654752]}])");
}
const std::string kTwo("\0\0\0\0\1\0\0\0\0\1\0\0", 12);
const std::vector<glm::dvec3> kTwoPlaces = {{1, 0, 0}, {0, 3, 0}, {0, 1.5, 0}};

TEST_F(AssetsPose, JointsPlaceVerticesAndTheNodeOfTheMeshDoesNot) {
    const auto scene = good(skinned({1, 0, 0, 0, 1, 0, 0, 0, 0.5, 0.5, 0, 0}, kTwo, two_joints()));
    expect_corners(*scene, kTwoPlaces);
    EXPECT_FALSE(warns(*scene, "skin"));
    EXPECT_NEAR(scene->bounds.max.y, 3.0, 1e-6);
}

TEST_F(AssetsPose, WeightsAreMadeToSumToOne) {
    expect_corners(*good(skinned({2, 0, 0, 0, 0.1f, 0, 0, 0, 7, 7, 0, 0}, kTwo, two_joints())), kTwoPlaces);
    Json bytes = skinned({1, 0, 0, 0, 1, 0, 0, 0, 0.5, 0.5, 0, 0}, kTwo, two_joints());
    bytes["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] =
        add_accessor(bytes, std::string("\xfe\0\0\0\xff\0\0\0\x7f\x7f\0\0", 12), 5121, 3, "VEC4", true);
    expect_corners(*good(bytes), kTwoPlaces);
    const auto none = good(skinned({0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0}, kTwo, two_joints()));
    expect_corners(*none, kTwoPlaces);
    EXPECT_TRUE(warns(*none, "vertices without weights follow their first joint; changes lux"));
}

TEST_F(AssetsPose, EightJointsOfTwoSets) {
    Json joints = Json::array();
    for (int i = 0; i < 8; ++i) joints.push_back({{"translation", {i, 0, 0}}});
    std::string low, high;
    for (int i = 0; i < 3; ++i) low += std::string("\0\1\2\3", 4), high += std::string("\4\5\6\7", 4);
    Json document = skinned(std::vector<float>(12, 0.125f), low, joints);
    add_set(document, 1, std::vector<float>(12, 0.125f), high);
    expect_corners(*good(document), {{3.5, 0, 0}, {4.5, 0, 0}, {3.5, 1, 0}});
}

// The joint's place in the world has its parents' too, and what it binds is seen from where the joint was.
TEST_F(AssetsPose, InverseBindMatricesAndParents) {
    Json document = skinned(kWhole, kFirst, Json::parse(R"([{"translation": [0, 0, 3]}])"));
    document["nodes"].push_back({{"scale", {2, 2, 2}}, {"translation", {10, 0, 0}}, {"children", {1}}});
    document["skins"][0]["inverseBindMatrices"] =
        add_accessor(document, bytes_of({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1}), 5126, 1, "MAT4");
    expect_corners(*good(document), {{8, 0, 6}, {10, 0, 6}, {8, 2, 6}});
}

// As a survey's coordinates are: single precision has steps of 1 m there.
TEST_F(AssetsPose, FarJointsKeepTheirMillimetres) {
    const auto scene = good(skinned(kWhole, kFirst, Json::parse(R"([{"translation": [10000000.25, 0, 0]}])")));
    EXPECT_TRUE(warns(*scene, "relative to 10000000, 0, 0 m:"));
    expect_corners(*scene, {{0.25, 0, 0}, {1.25, 0, 0}, {0.25, 1, 0}}, 1e-6);
}

TEST_F(AssetsPose, NormalsAreThoseOfTheStretchedSurface) {
    const float half = std::sqrt(0.5f);
    Json document = skinned(kWhole, kFirst, Json::parse(R"([{"scale": [2, 1, 1]}])"));
    add_normals(document, {half, half, 0, half, half, 0, 0, 0, 1});
    const auto scene = good(document);
    const glm::dvec3 expected = glm::normalize(glm::dvec3(0.5, 1.0, 0.0));
    EXPECT_LT(glm::length(glm::dvec3(scene->meshes.at(0).vertices.at(0).normal) - expected), 1e-6);
    EXPECT_LT(glm::length(glm::dvec3(scene->meshes[0].vertices[2].normal) - glm::dvec3(0, 0, 1)), 1e-6);
}

// Mirrored in X the triangle still faces +Z: its corners run counter-clockwise seen from there.
TEST_F(AssetsPose, AMirroringJointKeepsTheFront) {
    for (const bool with_normals : {false, true}) {
        Json document = skinned(kWhole, kFirst, Json::parse(R"([{"scale": [-1, 1, 1]}])"));
        if (with_normals) add_normals(document, {0, 0, 1, 0, 0, 1, 0, 0, 1});
        const auto scene = good(document);
        const auto p = corners(*scene);
        ASSERT_EQ(p.size(), 3u);
        EXPECT_GT(glm::cross(p[1] - p[0], p[2] - p[0]).z, 0.0) << with_normals;
        for (const Vertex& vertex : scene->meshes.at(0).vertices) EXPECT_EQ(vertex.normal, glm::vec3(0, 0, 1));
    }
}

TEST_F(AssetsPose, OneMeshWithTwoSkinsStandsTwice) {
    Json document = skinned(kWhole, kFirst, Json::parse(R"([{"translation": [1, 0, 0]}, {"translation": [5, 0, 0]}])"));
    document["skins"] = Json::parse(R"([{"joints": [1]}, {"joints": [2]}])");
    document["nodes"].push_back({{"mesh", 0}, {"skin", 1}});
    document["nodes"].push_back({{"mesh", 0}, {"translation", {0, 0, 7}}});  // without a skin its own place counts
    document["scenes"][0]["nodes"] = {0, 3, 4};
    expect_corners(*good(document),
                   {{1, 0, 0}, {2, 0, 0}, {1, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}, {0, 0, 7}, {1, 0, 7}, {0, 1, 7}});
}

TEST_F(AssetsPose, AnInstancedSkinStandsOnce) {
    Json document = skinned(kWhole, kFirst, Json::parse(R"([{"translation": [1, 0, 0]}])"));
    const int places = add_accessor(document, bytes_of({0, 0, 0, 9, 0, 0}), 5126, 2, "VEC3");
    document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = places;
    const auto scene = good(document);
    expect_corners(*scene, {{1, 0, 0}, {2, 0, 0}, {1, 1, 0}});
    EXPECT_TRUE(warns(*scene, "a skinned mesh stands once"));
}

TEST_F(AssetsPose, SkinRefusals) {
    const Json joint = Json::parse(R"([{"translation": [1, 0, 0]}])");
    refused(skinned(kWhole, std::string("\0\0\0\0\1\0\0\0\0\0\0\0", 12), joint), "out_of_bounds",
            std::string(kPrimitive) + "/attributes/JOINTS_0");
    // What no weight uses may be anything.
    good(skinned(kWhole, std::string("\0\7\0\0\0\0\x9\0\0\0\0\0", 12), joint));
    Json document = skinned(kWhole, kFirst, joint);
    document["nodes"][0]["skin"] = 1;
    refused(document, "out_of_bounds", "/nodes/0/skin");
    document = skinned(kWhole, kFirst, joint);
    document["skins"][0]["joints"][0] = 2;
    refused(document, "out_of_bounds", "/skins/0/joints/0");
    document = skinned(kWhole, kFirst, two_joints());
    document["skins"][0]["inverseBindMatrices"] = 0;  // three positions
    refused(document, "bad_gltf", "/skins/0/inverseBindMatrices");
    document["skins"][0]["inverseBindMatrices"] =
        add_accessor(document, bytes_of({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}), 5126, 1, "MAT4");
    refused(document, "bad_gltf", "/skins/0/inverseBindMatrices");
    document = skinned(kWhole, kFirst, joint);
    document["accessors"][1]["count"] = 2;
    refused(document, "bad_gltf", std::string(kPrimitive) + "/attributes/JOINTS_0");
    document = skinned(kWhole, kFirst, Json::parse(R"([{"scale": [1e29, 1, 1]}])"));
    document["nodes"].push_back({{"scale", {1e29, 1, 1}}, {"children", {1}}});
    refused(document, "bad_gltf", "/nodes/1");
    // 2^31 matrices that no byte stands behind.
    document = skinned(kWhole, kFirst, joint);
    document["accessors"].push_back({{"componentType", 5126}, {"count", 2147483647}, {"type", "MAT4"}});
    document["skins"][0]["inverseBindMatrices"] = document["accessors"].size() - 1;
    const auto result = load_scene(write("scene.gltf", document.dump()), "", {}, std::size_t{1} << 32);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, "too_large");
}

TEST_F(AssetsPose, WeightsOfTheNodeComeBeforeThoseOfTheMesh) {
    Json document = triangle();
    add_target(document, {0, 0, 1, 0, 0, 1, 0, 0, 1});
    add_target(document, {4, 0, 0, 0, 0, 0, 0, 0, 0});
    expect_corners(*good(document), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    document["meshes"][0]["weights"] = {0.5, 0};
    expect_corners(*good(document), {{0, 0, 0.5}, {1, 0, 0.5}, {0, 1, 0.5}});
    document["nodes"].push_back({{"mesh", 0}, {"weights", {0, 0.125}}});
    document["nodes"].push_back({{"mesh", 0}, {"weights", {2, 0}}});
    document["scenes"][0]["nodes"] = {0, 1, 2};
    const auto scene = good(document);
    expect_corners(
        *scene,
        {{0, 0, 0.5}, {1, 0, 0.5}, {0, 1, 0.5}, {0.5, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 2}, {1, 0, 2}, {0, 1, 2}});
    EXPECT_FALSE(warns(*scene, "morph"));
    document["nodes"][2]["weights"] = {0, 0, 1};
    EXPECT_TRUE(warns(*good(document), "weights beyond the morph targets were left out; changes lux"));
}

// A normal of the file is morphed; one that the file lacks is that of the morphed triangle.
TEST_F(AssetsPose, NormalsMorphToo) {
    Json document = triangle();
    document["meshes"][0]["weights"] = {0.5};
    add_target(document, {0, 0, 0, 0, 0, 2, 0, 0, 0});  // to (1, 0, 1)
    const float half = std::sqrt(0.5f);
    auto scene = good(document);
    for (const Vertex& vertex : scene->meshes.at(0).vertices)
        EXPECT_LT(glm::length(vertex.normal - glm::vec3(-half, 0, half)), 1e-6f);
    add_normals(document, {0, 0, 1, 0, 0, 1, 0, 0, 1});
    scene = good(document);
    for (const Vertex& vertex : scene->meshes.at(0).vertices) EXPECT_EQ(vertex.normal, glm::vec3(0, 0, 1));
    document["meshes"][0]["primitives"][0]["targets"][0]["NORMAL"] =
        add_accessor(document, bytes_of({0, 0, 0, -2, 0, 0, -2, 0, 0}), 5126, 3, "VEC3");
    scene = good(document);
    EXPECT_EQ(scene->meshes.at(0).vertices.at(0).normal, glm::vec3(0, 0, 1));
    EXPECT_LT(glm::length(scene->meshes[0].vertices.at(1).normal - glm::vec3(-half, 0, half)), 1e-6f);
}

TEST_F(AssetsPose, TangentsMorphAndTurnWithTheirJoint) {
    write("t.png", *encode_png({1, 1, {1, 2, 3}}));
    Json document = textured("t.png");
    document["materials"][0]["normalTexture"]["index"] = 0;
    add_normals(document, {0, 0, 1, 0, 0, 1, 0, 0, 1});
    document["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] =
        add_accessor(document, bytes_of({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}), 5126, 3, "VEC4");
    add_target(document, {-1, 1, 0, -1, 1, 0, -1, 1, 0}, "TANGENT");
    document["meshes"][0]["weights"] = {1};
    auto scene = good(document);
    EXPECT_EQ(scene->meshes.at(0).tangents.size(), 3u);
    for (const glm::vec4& tangent : scene->meshes[0].tangents) EXPECT_EQ(tangent, glm::vec4(0, 1, 0, 1));
    // A quarter turn about Z takes +Y to -X; the mirror turns the texture over.
    document["nodes"][0]["skin"] = 0;
    document["nodes"].push_back(
        Json::parse(R"({"rotation": [0, 0, 0.70710678118654752, 0.70710678118654752], "scale": [-1, 1, 1]})"));
    document["skins"] = Json::parse(R"([{"joints": [1]}])");
    add_set(document, 0, kWhole, kFirst);
    scene = good(document);
    ASSERT_EQ(scene->meshes.at(0).tangents.size(), 3u);
    for (const glm::vec4& tangent : scene->meshes[0].tangents)
        EXPECT_LT(glm::length(tangent - glm::vec4(-1, 0, 0, -1)), 1e-6f);
}

TEST_F(AssetsPose, SparseAndQuantisedTargets) {
    Json document = triangle();
    document["meshes"][0]["weights"] = {1};
    const int indices = add_view(document, std::string("\2\0", 2)), values = add_view(document, bytes_of({0, 3, 0}));
    document["accessors"].push_back({{"componentType", 5126},
                                     {"count", 3},
                                     {"type", "VEC3"},
                                     {"sparse",
                                      {{"count", 1},
                                       {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                                       {"values", {{"bufferView", values}}}}}});
    document["meshes"][0]["primitives"][0]["targets"] = Json::array({Json{{"POSITION", 1}}});
    expect_corners(*good(document), {{0, 0, 0}, {1, 0, 0}, {0, 4, 0}});
    Json bytes = triangle();
    bytes["meshes"][0]["weights"] = {2};
    const int moves = add_accessor(bytes, std::string("\0\0\x7f\0\0\x7f\0\0\x81", 9), 5120, 3, "VEC3", true);
    bytes["meshes"][0]["primitives"][0]["targets"] = Json::array({Json{{"POSITION", moves}}});
    expect_corners(*good(bytes), {{0, 0, 2}, {1, 0, 2}, {0, 1, -2}});
}

// Turned by 90 degrees about Z a displacement along X is one along Y.
TEST_F(AssetsPose, MorphTargetsComeBeforeTheSkin) {
    Json document = skinned({1, 0, 0, 0, 1, 0, 0, 0, 0.5, 0.5, 0, 0}, kTwo, two_joints());
    add_target(document, {0, 0, 0, 5, 0, 0, 0, 0, 0});
    document["nodes"][0]["weights"] = {1};
    expect_corners(*good(document), {{1, 0, 0}, {0, 8, 0}, {0, 1.5, 0}});
}

TEST_F(AssetsPose, MorphRefusals) {
    Json document = triangle();
    document["meshes"][0]["weights"] = {1};
    document["meshes"][0]["primitives"][0]["targets"] =
        Json::array({Json{{"POSITION", add_accessor(document, bytes_of({0, 0, 0, 0, 0, 0}), 5126, 2, "VEC3")}}});
    refused(document, "bad_gltf", std::string(kPrimitive) + "/targets/0/POSITION");
    document["meshes"][0]["weights"] = {0};
    good(document);
    document["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = 0;
    document["meshes"][0]["weights"] = {1e300};
    refused(document, "bad_gltf", std::string(kPrimitive) + "/targets");
    document["meshes"][0]["weights"] = {"much"};
    refused(document, "bad_gltf", "/meshes/0/weights/0");
    // Targets share their bytes: what a small file asks for is bounded.
    document = with_positions(std::vector<float>(9000, 0.0f));
    document["meshes"][0]["weights"] = std::vector<double>(100'000, 1.0);
    document["meshes"][0]["primitives"][0]["targets"] = Json(std::vector<Json>(100'000, Json{{"POSITION", 0}}));
    const auto result = load(document);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, "too_large");
}

// A floor at 0, below it the lamp of 900 cd at 3 m; between them a board on a node below a group.
Json lit_floor() {
    Json document = with_positions({-4, 0, 4, 4, 0, 4, 0, 0, -4});
    document["meshes"].push_back(document["meshes"][0]);
    document["nodes"] = Json::parse(R"([{"mesh": 0},
        {"translation": [0, 3, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"name": "group", "children": [3]},
        {"mesh": 1, "translation": [0, 1.5, 0], "scale": [0.25, 0.25, 0.25], "children": [4]},
        {"translation": [0, 3, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}}])");
    document["scenes"][0]["nodes"] = {0, 1, 2};
    document["extensions"]["KHR_lights_punctual"]["lights"] = Json::parse(R"([{"type": "point", "intensity": 900}])");
    document["extensionsUsed"] = {"KHR_lights_punctual", "KHR_node_visibility"};
    return document;
}

double lux_under_the_lamp(const std::shared_ptr<const SceneAsset>& scene) {
    const trace::MeterPoint points[] = {{{0, 0, 0}, {0, 1, 0}}};
    trace::Settings settings;
    settings.bounces = 0;
    return trace::measure(*trace::make_world(scene_of(scene)), points, settings).front().direct_lx.g;
}

void set_visible(Json& document, int node, bool visible) {
    document["nodes"][static_cast<std::size_t>(node)]["extensions"]["KHR_node_visibility"]["visible"] = visible;
}

// 900 cd at 3 m are 100 lx.
TEST_F(AssetsPose, HiddenNodesHideMeshesAndLightsBelowThem) {
    Json document = lit_floor();
    EXPECT_EQ(good(document)->lights.size(), 2u);
    set_visible(document, 2, true);
    EXPECT_EQ(good(document)->instances.size(), 2u);
    set_visible(document, 2, false);
    set_visible(document, 3, true);  // what is above it hides it all the same
    document["extensionsRequired"] = {"KHR_node_visibility"};
    const auto scene = good(document);
    EXPECT_EQ(scene->instances.size(), 1u);
    ASSERT_EQ(scene->lights.size(), 1u);
    EXPECT_NEAR(lux_under_the_lamp(scene), 100.0, 1e-3);
    EXPECT_FALSE(warns(*scene, "KHR_node_visibility"));
    set_visible(document, 2, true);
    set_visible(document, 3, false);
    EXPECT_EQ(good(document)->instances.size(), 1u);
    EXPECT_EQ(good(document)->lights.size(), 1u);
    document["nodes"][3]["extensions"]["KHR_node_visibility"]["visible"] = 0;
    refused(document, "bad_gltf", "/nodes/3/extensions/KHR_node_visibility/visible");
}

TEST_F(AssetsPose, TheFirstKeyOfAnAnimationSetsVisibility) {
    Json document = lit_floor();
    const int times = add_accessor(document, bytes_of({0, 1}), 5126, 2, "SCALAR"),
              hides = add_accessor(document, std::string("\0\1", 2), 5121, 2, "SCALAR"),
              shows = add_accessor(document, std::string("\1\0", 2), 5121, 2, "SCALAR");
    document["animations"] = Json::parse(R"([{"samplers": [{"interpolation": "STEP"}], "channels": [{"sampler": 0,
        "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {
        "pointer": "/nodes/2/extensions/KHR_node_visibility/visible"}}}}]}])");
    Json& sampler = document["animations"][0]["samplers"][0];
    sampler["input"] = times;
    sampler["output"] = hides;
    set_visible(document, 2, true);
    EXPECT_NEAR(lux_under_the_lamp(good(document)), 100.0, 1e-3);
    sampler["output"] = shows;
    set_visible(document, 2, false);
    EXPECT_EQ(good(document)->instances.size(), 2u);
    // Animations that are not as they should be say nothing, and what the node says itself counts.
    for (const char* odd :
         {"/nodes/2/extensions/KHR_node_visibility", "/nodes/99/extensions/KHR_node_visibility/visible",
          "/nodes//extensions/KHR_node_visibility/visible", "/nodes/2/translation", ""}) {
        document["animations"][0]["channels"][0]["target"]["extensions"]["KHR_animation_pointer"]["pointer"] = odd;
        EXPECT_EQ(good(document)->instances.size(), 1u) << odd;
    }
    document["animations"] = Json::parse(R"([1, {"channels": 2}, {"channels": [3, {"target": 4}]}])");
    EXPECT_EQ(good(document)->instances.size(), 1u);
}

}  // namespace
}  // namespace gonio
