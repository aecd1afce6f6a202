// What surfaces look like, by small glTF files whose picture is known in closed form: in the CPU's G-buffer and to the
// path tracer's rays.
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <numbers>

#include "server/assets/gltf_import.h"
#include "server/lighting/raster.h"
#include "server/lighting/screen.h"
#include "server/scene/apply.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

constexpr int kSide = 96;  // pixels of a picture

// A square from (0, 0, 0) to (1, 1, 0) that faces +Z, of material 0. uv: texture repeats along its sides.
Json square(double uv = 1.0) {
    Json document = with_positions({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
    const auto t = static_cast<float>(uv);
    add_accessor(document, bytes_of({0, 0, t, 0, t, t, 0, t}), 5126, 4, "VEC2");
    add_accessor(document, std::string("\x00\x01\x02\x00\x02\x03", 6), 5121, 6, "SCALAR");
    Json& primitive = document["meshes"][0]["primitives"][0];
    primitive["attributes"]["TEXCOORD_0"] = 1;
    primitive["indices"] = 2;
    primitive["material"] = 0;
    document["materials"] = Json::parse(R"([{"pbrMetallicRoughness": {}}])");
    return document;
}

struct Look {
    glm::dvec3 position{0.0};
    glm::vec3 albedo{0.0f}, traced{0.0f};  // of the G-buffer, and of a ray through the pixel's centre
};

// What an eye at z sees of the square, pixel by pixel; none where nothing is.
std::vector<Look> looks(const std::shared_ptr<const SceneAsset>& asset, double z = 2.0) {
    const trace::Geometry geometry(asset);
    lighting::GBuffer gbuffer;
    lighting::Raster raster;
    Pool pool;
    const Camera camera{{0.52, 0.47, z}, {0.52, 0.47, 0.0}, 0.7};
    lighting::look_through(eye_of(camera, kSide, kSide), geometry, 1e-4f, kSide, kSide, gbuffer);
    lighting::draw_gbuffer(lighting::make_clusters(geometry), lighting::make_material_table(geometry), false, gbuffer,
                           raster, pool);
    std::vector<Look> found;
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const lighting::Spot spot = lighting::spot_at(gbuffer, x, y);
            if (!(spot.depth > 0.0f)) continue;
            const std::size_t at = 4 * (static_cast<std::size_t>(y) * gbuffer.row_length + static_cast<std::size_t>(x));
            Look look{geometry.origin() + glm::dvec3(spot.position), {}, {}};
            for (std::size_t k = 0; k < 3; ++k)
                look.albedo[static_cast<int>(k)] = glm::unpackHalf1x16(raster.albedo[at + k]);
            trace::SurfaceHit hit;
            EXPECT_TRUE(
                geometry.closest(gbuffer.rays.eye, glm::normalize(spot.position - gbuffer.rays.eye), 0.0f, true, hit));
            look.traced = hit.albedo;
            found.push_back(look);
        }
    }
    return found;
}

class Materials : public GltfFixture {
protected:
    // A picture of 64 × 1 texels whose reflectance grows from 0 to 0.9 along u.
    void write_ramp() {
        BytePicture ramp{64, 1, {}};
        for (int i = 0; i < 64; ++i) {
            const double linear = 0.9 * (i + 0.5) / 64, encoded = 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
            for (int k = 0; k < 3; ++k)
                ramp.rgb.push_back(
                    static_cast<std::uint8_t>(std::lround(255.0 * (linear <= 0.0031308 ? 12.92 * linear : encoded))));
        }
        write("ramp.png", *encode_png(ramp));
    }
};

TEST_F(Materials, MirroredRepetitionTurnsOver) {
    write_ramp();
    Json document = square(3.0);
    document["images"] = Json::parse(R"([{"uri": "ramp.png"}])");
    document["samplers"] = Json::parse(R"([{"wrapS": 33648, "wrapT": 33648}])");
    document["textures"] = Json::parse(R"([{"source": 0, "sampler": 0}])");
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    const auto asset = good(document);
    EXPECT_TRUE(asset->warnings.empty());
    const std::vector<Look> all = looks(asset);
    ASSERT_GT(all.size(), 1000u);
    for (const Look& look : all) {
        const double u = 3.0 * look.position.x, there = std::fmod(u, 2.0), folded = there > 1.0 ? 2.0 - there : there;
        // A texel is 0.014 wide in reflectance; the edge's is blurred half a texel more.
        ASSERT_NEAR(look.traced.r, 0.9 * folded, 0.01) << u;
        ASSERT_NEAR(look.albedo.r, 0.9 * folded, 0.025) << u;  // and a pixel's width
    }
}

TEST_F(Materials, VertexColoursMultiplyTheBaseColour) {
    // From 0.2 at x = 0 to 0.8 at x = 1, which both triangles interpolate alike.
    const auto bytes = [](std::initializer_list<int> values, int size) {
        std::string text;
        for (const int value : values)
            for (int k = 0; k < size; ++k) text += static_cast<char>(value >> (8 * k) & 255);
        return text;
    };
    struct Case {
        std::string values;
        int type;
        const char* shape;
    };
    const Case cases[] = {
        {bytes_of({.2f, .2f, .2f, .8f, .8f, .8f, .8f, .8f, .8f, .2f, .2f, .2f}), 5126, "VEC3"},
        {bytes({51, 51, 51, 255, 204, 204, 204, 255, 204, 204, 204, 255, 51, 51, 51, 255}, 1), 5121, "VEC4"},
        {bytes({13107, 13107, 13107, 65535, 52428, 52428, 52428, 65535, 52428, 52428, 52428, 65535, 13107, 13107, 13107,
                65535},
               2),
         5123, "VEC4"}};
    for (const Case& c : cases) {
        Json document = square();
        document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1.0, 0.5, 0.25, 1.0};
        document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
            add_accessor(document, c.values, c.type, 4, c.shape, c.type != 5126);
        const auto asset = good(document);
        EXPECT_TRUE(asset->warnings.empty()) << asset->warnings.front();
        const std::vector<Look> all = looks(asset);
        ASSERT_GT(all.size(), 1000u);
        for (const Look& look : all) {
            const glm::vec3 expected =
                glm::vec3(1.0f, 0.5f, 0.25f) * (0.2f + 0.6f * static_cast<float>(look.position.x));
            for (int k = 0; k < 3; ++k) {
                ASSERT_NEAR(look.traced[k], expected[k], 1e-3f);
                ASSERT_NEAR(look.albedo[k], expected[k], 1e-3f);
            }
        }
    }
}

// Colours, not the white factor beside them, are what reflects too much.
TEST_F(Materials, VertexColoursAreBoundedThemselves) {
    Json document = square();
    document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
        add_accessor(document, bytes_of({.5f, .5f, .5f, .5f, .5f, .5f, 1, 1, 1, .5f, .5f, .5f}), 5126, 4, "VEC3");
    const auto asset = good(document);
    EXPECT_TRUE(warns(*asset, "--max-albedo"));
    EXPECT_EQ(asset->materials[0].base_color, glm::vec4(1.0f));
    EXPECT_NEAR(asset->meshes[0].colors[0].r / 65535.0, 0.5, 1e-4);
    EXPECT_NEAR(asset->meshes[0].colors[2].r / 65535.0, 0.95, 1e-4);
}

TEST_F(Materials, VertexAlphaCutsHoles) {
    Json document = square();
    document["materials"][0]["alphaMode"] = "MASK";
    document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = add_accessor(
        document, bytes_of({.5f, .5f, .5f, 0, .5f, .5f, .5f, 1, .5f, .5f, .5f, 1, .5f, .5f, .5f, 0}), 5126, 4, "VEC4");
    const std::vector<Look> all = looks(good(document));
    ASSERT_GT(all.size(), 500u);
    for (const Look& look : all) ASSERT_GT(look.position.x, 0.5 - 1e-4);
}

// A look into a doll's house: the back of a one-sided surface is not there for viewers unless it is asked for. Light
// is stopped by it either way.
TEST_F(Materials, BacksAreCulledForViewersOnly) {
    const std::string path = write("square.gltf", square().dump());
    const auto culled = *load_scene(path), shown = *load_scene(path, "", {.show_backs = true});
    EXPECT_GT(looks(culled).size(), 1000u);
    EXPECT_EQ(looks(culled, -2.0).size(), 0u);
    EXPECT_EQ(looks(shown, -2.0).size(), looks(shown, 2.0).size());
    for (const auto& asset : {culled, shown}) {
        const trace::Geometry geometry(asset);
        const glm::vec3 before = geometry.local({0.4, 0.4, 1.0}), behind = geometry.local({0.4, 0.4, -1.0});
        EXPECT_TRUE(geometry.occluded(before, behind) && geometry.occluded(behind, before));
        trace::SurfaceHit hit;
        EXPECT_EQ(geometry.closest(behind, {0, 0, 1}, 0.0f, true, hit), asset == shown);
        EXPECT_TRUE(geometry.closest(behind, {0, 0, 1}, 0.0f, false, hit));
    }
    EXPECT_TRUE((*load_scene("cornell", "", {.show_backs = true}))->materials[0].show_back);
}

// A normal map of one normal, tilted by 30° to the right or up in the texture: shading normals, of the file's texture
// coordinates, of those of a texture that is turned over, of tangents in the file, from a mirrored node, at half scale.
TEST_F(Materials, NormalMapsTiltTheNormal) {
    const double tilt = std::numbers::pi / 6;
    const auto byte = [](double value) { return static_cast<std::uint8_t>(std::lround(127.5 * (value + 1.0))); };
    write("right.png", *encode_png({1, 1, {byte(std::sin(tilt)), byte(0.0), byte(std::cos(tilt))}}));
    write("up.png", *encode_png({1, 1, {byte(0.0), byte(std::sin(tilt)), byte(std::cos(tilt))}}));
    const auto normals_of = [&](const Json& document) {
        const auto asset = good(document);
        const trace::Geometry geometry(asset);
        lighting::GBuffer gbuffer;
        lighting::Raster raster;
        Pool pool;
        const double x = asset->instances[0].world_from_mesh[0][0] < 0.0 ? -0.52 : 0.52;
        lighting::look_through(eye_of({{x, 0.47, 2.0}, {x, 0.47, 0.0}, 0.7}, 16, 16), geometry, 1e-4f, 16, 16, gbuffer);
        lighting::draw_gbuffer(lighting::make_clusters(geometry), lighting::make_material_table(geometry), false,
                               gbuffer, raster, pool);
        EXPECT_NEAR(lighting::spot_at(gbuffer, 8, 8).normal.z, 1.0f, 1e-3f);  // links take the smooth one
        std::swap(gbuffer.normal, gbuffer.detail);
        trace::SurfaceHit hit;
        EXPECT_TRUE(geometry.closest(gbuffer.rays.eye, {0, 0, -1}, 0.0f, true, hit));
        EXPECT_GT(hit.geometric.z, 0.99f);
        return std::array{lighting::spot_at(gbuffer, 8, 8).normal, hit.normal};
    };
    const auto expect = [](const std::array<glm::vec3, 2>& found, double x, double y, const char* what) {
        for (const glm::vec3& n : found) {
            EXPECT_NEAR(n.x, x, 0.01) << what;
            EXPECT_NEAR(n.y, y, 0.01) << what;
            EXPECT_NEAR(n.z, std::sqrt(1.0 - x * x - y * y), 0.01) << what;
        }
    };
    Json document = square();
    document["textures"] = Json::parse(R"([{"source": 0}])");
    document["materials"][0]["normalTexture"] = {{"index", 0}};
    document["images"] = Json::parse(R"([{"uri": "right.png"}])");
    const double s = std::sin(tilt);
    expect(normals_of(document), s, 0.0, "right");
    document["nodes"][0]["scale"] = {-1, 1, 1};
    expect(normals_of(document), -s, 0.0, "right, mirrored");
    document["images"][0]["uri"] = "up.png";  // v grows with y: up in the texture is down
    expect(normals_of(document), 0.0, -s, "up, mirrored");
    document["nodes"][0].erase("scale");
    expect(normals_of(document), 0.0, -s, "up");
    document["materials"][0]["normalTexture"]["scale"] = 0.5;
    const double half = std::atan(0.5 * std::tan(tilt));
    expect(normals_of(document), 0.0, -std::sin(half), "up at half scale");
    document["materials"][0]["normalTexture"].erase("scale");
    Json& attributes = document["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_0"] = add_accessor(document, bytes_of({0, 1, 1, 1, 1, 0, 0, 0}), 5126, 4, "VEC2");
    expect(normals_of(document), 0.0, s, "up, v down");
    document["images"][0]["uri"] = "right.png";
    expect(normals_of(document), s, 0.0, "right, v down");
    std::vector<float> flat, turned;
    for (int i = 0; i < 4; ++i) {
        flat.insert(flat.end(), {0, 0, 1});
        turned.insert(turned.end(), {0, 1, 0, 1});
    }
    attributes["NORMAL"] = add_accessor(document, bytes_of(flat), 5126, 4, "VEC3");
    attributes["TANGENT"] = add_accessor(document, bytes_of(turned), 5126, 4, "VEC4");
    expect(normals_of(document), 0.0, s, "the file's tangents");
}

// Triangles that share a vertex and turn the texture over, each its own way, keep their directions.
TEST_F(Materials, ASeamHasTwoTangents) {
    Mesh mesh;
    for (const glm::vec2 p : {glm::vec2{0, 0}, {0, 1}, {1, 0}, {-1, 0}})
        mesh.vertices.push_back({glm::vec3(p, 0.0f), glm::vec3(0, 0, 1), glm::vec2(std::abs(p.x), -p.y)});
    mesh.indices = {0, 2, 1, 0, 1, 3};
    derive_tangents(mesh);
    ASSERT_EQ(mesh.vertices.size(), 6u);
    ASSERT_EQ(mesh.tangents.size(), 6u);
    for (std::size_t k = 0; k < 6; ++k) {
        const glm::vec4 tangent = mesh.tangents[mesh.indices[k]];
        EXPECT_NEAR(tangent.x, k < 3 ? 1.0f : -1.0f, 1e-5f) << k;
        EXPECT_EQ(tangent.w, k < 3 ? 1.0f : -1.0f) << k;
    }
}

// A node that mirrors its mesh shows its front where the mesh does.
TEST_F(Materials, AMirroredSquareFacesItsFront) {
    Json document = square();
    document["nodes"][0]["scale"] = {-1, 1, 1};
    const auto asset = good(document);
    const trace::Geometry geometry(asset);
    lighting::GBuffer gbuffer;
    lighting::Raster raster;
    Pool pool;
    lighting::look_through(eye_of({{-0.5, 0.5, 2.0}, {-0.5, 0.5, 0.0}, 0.7}, 16, 16), geometry, 1e-4f, 16, 16, gbuffer);
    lighting::draw_gbuffer(lighting::make_clusters(geometry), lighting::make_material_table(geometry), false, gbuffer,
                           raster, pool);
    EXPECT_NEAR(lighting::spot_at(gbuffer, 8, 8).normal.z, 1.0f, 1e-3f);
}

// What emits on one side emits on that side though its back is shown.
TEST_F(Materials, AShownBackDoesNotEmit) {
    Json document = square();
    document["materials"][0]["emissiveFactor"] = {1, 1, 1};
    const std::string path = write("lamp.gltf", document.dump());
    const auto asset = *load_scene(path, "", {.show_backs = true});
    const trace::Geometry geometry(asset);
    for (const double z : {2.0, -2.0}) {
        lighting::GBuffer gbuffer;
        lighting::Raster raster;
        Pool pool;
        const Camera camera{{0.5, 0.5, z}, {0.5, 0.5, 0.0}, 0.7};
        lighting::look_through(eye_of(camera, 16, 16), geometry, 1e-4f, 16, 16, gbuffer);
        lighting::draw_gbuffer(lighting::make_clusters(geometry), lighting::make_material_table(geometry), true,
                               gbuffer, raster, pool);
        const std::size_t middle = 4 * (8 * gbuffer.row_length + 8);
        EXPECT_GT(gbuffer.depth[middle / 4], 0.0f);
        EXPECT_EQ(raster.emission[middle], z > 0.0 ? 1.0f : 0.0f);
    }
}

}  // namespace
}  // namespace gonio
