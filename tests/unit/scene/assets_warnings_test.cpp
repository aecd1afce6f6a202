// What a load warns of: whether it says that lux change, and how often.
#include "server/assets/assets.h"
#include "server/assets/gltf_features.h"
#include "server/scene/light_tables.h"
#include "server/scene/scene.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

class AssetsWarnings : public GltfFixture {
protected:
    static std::size_t times(const SceneAsset& scene, const std::string& words) {
        std::size_t count = 0;
        for (const std::string& warning : scene.warnings) count += warning.find(words) != std::string::npos;
        return count;
    }
    // A triangle of one material, with textures 0 and 1 and no texture coordinates but set 0.
    Json with_material(const std::string& material) {
        write("t.png", *encode_png({1, 1, {1, 2, 3}}));
        Json document = textured("t.png");
        document["textures"].push_back({{"source", 0}});
        document["materials"] = Json::array({Json::parse(material)});
        return document;
    }
    static Json with_spot(double inner, double outer) {
        Json document = triangle();
        document["extensionsUsed"] = {"KHR_lights_punctual"};
        document["extensions"]["KHR_lights_punctual"]["lights"] = {
            {{"type", "spot"}, {"spot", {{"innerConeAngle", inner}, {"outerConeAngle", outer}}}}};
        document["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
        return document;
    }
};

TEST_F(AssetsWarnings, OfMaterialsSayThatLuxChange) {
    const std::pair<const char*, const char*> cases[] = {
        {R"({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 2, 0.5, 1]}})",
         "a baseColorFactor outside 0..1 was clamped; changes lux (/materials/0)"},
        {R"({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1.5}}})",
         "a transmissionFactor outside 0..1 was clamped; changes lux (/materials/0)"},
        {R"({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.2, 0.5, 1]},
             "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}}})",
         "and the reference have its colour; changes lux (/materials/0)"},
        {R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
             "normalTexture": {"index": 1, "texCoord": 1}})",
         "the normal texture uses another texture's coordinates; changes lux (/materials/0)"},
        {R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "extensions": {"KHR_materials_transmission":
             {"transmissionFactor": 0.5, "transmissionTexture": {"index": 1, "texCoord": 1}}}})",
         "the transmission texture uses another texture's coordinates; changes lux (/materials/0)"},
    };
    for (const auto& [material, said] : cases) {
        Json document = with_material(material);
        document["extensionsUsed"] = {"KHR_materials_transmission"};
        const auto scene = good(document);
        EXPECT_EQ(times(*scene, said), 1u) << said;
    }
}

TEST_F(AssetsWarnings, OfMeshesSayThatLuxChange) {
    Json colours = triangle();
    colours["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
        add_accessor(colours, bytes_of({2, 0, 0, 0, 0, 0, 0, 0, 0}), 5126, 3, "VEC3");
    EXPECT_EQ(times(*good(colours), "vertex colours outside 0..1 were clamped; changes lux (/meshes/0/primitives/0)"),
              1u);
    Json normals = triangle();
    normals["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
        add_accessor(normals, bytes_of({0, 0, 0, 0, 0, 1, 0, 0, 1}), 5126, 3, "VEC3");
    EXPECT_EQ(
        times(*good(normals), "normals of length 0 were rebuilt from the faces; changes lux (/meshes/0/primitives/0)"),
        1u);
    Json tangents = with_material(R"({"normalTexture": {"index": 0}})");
    auto& attributes = tangents["meshes"][0]["primitives"][0]["attributes"];
    attributes["NORMAL"] = add_accessor(tangents, bytes_of({0, 0, 1, 0, 0, 1, 0, 0, 1}), 5126, 3, "VEC3");
    attributes["TANGENT"] = add_accessor(tangents, bytes_of(std::vector<float>(12, 0.0f)), 5126, 3, "VEC4");
    EXPECT_EQ(times(*good(tangents), "tangents of length 0 were rebuilt from the texture coordinates; changes lux"),
              1u);
    Json nowhere = triangle();
    nowhere["meshes"][0]["primitives"].push_back({{"attributes", {{"NORMAL", 0}}}});
    EXPECT_EQ(times(*good(nowhere), "a primitive without positions was left out; changes lux (/meshes/0/primitives/1)"),
              1u);
}

TEST_F(AssetsWarnings, OfLightsSayThatLuxChange) {
    EXPECT_EQ(times(*good(with_spot(0.5, 0.4)), "its edge is sharp; changes lux"), 1u);
    EXPECT_EQ(times(*good(with_spot(0.2, 0.4)), "its edge"), 0u);
    // A web of 0.005 degrees between two angles is finer than a picture shows (kLeastStepV_deg).
    std::string ies =
        "IESNA:LM-63-2002\n[TEST] a\n[TESTLAB] b\n[ISSUEDATE] 1-JAN-2024\n[MANUFAC] c\nTILT=NONE\n"
        "1 1000 1 20 1 1 2 0 0 0\n1 1 10\n";
    for (int i = 0; i < 19; ++i) ies += std::to_string(0.005 * i) + "\n";
    ies += "90\n0\n";
    for (int i = 0; i < 20; ++i) ies += std::to_string(1000 - 50 * i) + "\n";
    write("fine.ies", ies);
    Json document = with_spot(0.2, 0.4);
    document["extensionsUsed"].push_back("EXT_lights_ies");
    document["extensions"]["EXT_lights_ies"]["lights"] = {{{"uri", "fine.ies"}}};
    document["nodes"][0]["extensions"]["EXT_lights_ies"]["light"] = 0;
    const auto scene = good(document);
    EXPECT_EQ(times(*scene, "the punctual light beside the measured one was left out; changes lux (/nodes/0)"), 1u);
    ASSERT_EQ(scene->lights.size(), 1u);
    ASSERT_NE(known_thinned(*scene->lights[0].profile), "");
    EXPECT_EQ(times(*scene, "This changes lux (/extensions/EXT_lights_ies/lights/0)"), 1u);
}

TEST_F(AssetsWarnings, FeaturesOfMaterialsAreSaidOnceAFile) {
    const struct {
        FeatureName feature;
        const char *has, *lacks;
    } cases[] = {
        {"KHR_materials_transmission", R"({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}}})",
         R"({"extensions": {"KHR_materials_transmission": {}}})"},
        {"alpha BLEND", R"({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}})",
         R"({"alphaMode": "BLEND"})"},
        {"normal textures", R"({"normalTexture": {"index": 0}})", R"({"occlusionTexture": {"index": 0}})"},
        {"metallic-roughness materials", R"({"pbrMetallicRoughness": {"roughnessFactor": 0.1}})",
         R"({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.1}})"},
        {"metallic-roughness materials", R"({"pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 0}}})",
         R"({"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 1}})"},
    };
    for (const auto& c : cases) {
        SCOPED_TRACE(c.has);
        Json document = with_material(c.lacks);
        document["extensionsUsed"] = {"KHR_materials_transmission"};
        const std::string name = std::string(c.feature.row().name) + ":";
        EXPECT_EQ(times(*good(document), name), 0u);
        for (int i = 0; i < 2; ++i) document["materials"].push_back(Json::parse(c.has));
        EXPECT_EQ(times(*good(document), name), 0u) << "what no mesh shows is not worth a word";
        Json primitive = document["meshes"][0]["primitives"][0];
        for (int i = 1; i < 3; ++i) {
            primitive["material"] = i;
            document["meshes"][0]["primitives"].push_back(primitive);
        }
        const auto scene = good(document);
        EXPECT_EQ(times(*scene, name), 1u);
        EXPECT_EQ(times(*scene, feature_warning(c.feature, "/materials/1")), 1u);
    }
}

TEST_F(AssetsWarnings, ManyMaterialsWereBounded) {
    Json document = triangle();
    document["materials"] = Json::parse("[{}, {}]");
    Json& primitives = document["meshes"][0]["primitives"];
    primitives[0]["material"] = 0;
    EXPECT_EQ(times(*good(document), "never end a bounce; changes lux (1 material, albedo 1)"), 1u);
    primitives.push_back(primitives[0]);
    primitives[1]["material"] = 1;
    EXPECT_EQ(times(*good(document), "never end a bounce; changes lux (2 materials, albedo 1)"), 1u);
    document["materials"][1] = Json::parse(R"({"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.96, 0.3, 1]}})");
    EXPECT_EQ(times(*good(document), "changes lux (2 materials, albedo 0.96 to 1)"), 1u);
}

TEST_F(AssetsWarnings, ThoseLeftOutSayWhetherLuxChange) {
    Json points = triangle(), flat = triangle();
    for (int i = 0; i < 120; ++i) {
        points["meshes"][0]["primitives"].push_back({{"mode", 0}, {"attributes", {{"POSITION", 0}}}});
        flat["nodes"].push_back({{"mesh", 0}, {"scale", {1, 1, 0}}});
        flat["scenes"][0]["nodes"].push_back(i + 1);
    }
    points["materials"] = Json::parse(R"([{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}}])");
    points["meshes"][0]["primitives"][0]["material"] = 0;
    const auto same = good(points), other = good(flat);
    ASSERT_EQ(same->warnings.size(), 100u);
    EXPECT_EQ(same->warnings.back(), "more warnings were left out");
    ASSERT_EQ(other->warnings.size(), 100u);
    EXPECT_EQ(other->warnings.back(), "more warnings were left out; changes lux");
    EXPECT_NE(other->warnings.front().find("--max-albedo"), std::string::npos) << "it is said, however many there are";
}

}  // namespace
}  // namespace gonio
