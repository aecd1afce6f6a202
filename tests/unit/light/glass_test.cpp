// Light through transmissive surfaces, by small glTF files and by closed forms: shadow rays, paths, the CPU's picture.
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <numbers>
#include <set>

#include "server/lighting/raster.h"
#include "server/lighting/screen.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "server/trace/sources.h"
#include "shaders/lib/as_cpp.h"
#include "tests/scenes/scenes.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

using test::Piece;

// A square pane of 2 m around the origin that faces +Z, of material 0.
Json pane_document() {
    Json document = with_positions({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0});
    add_accessor(document, std::string("\x00\x01\x02\x00\x02\x03", 6), 5121, 6, "SCALAR");
    Json& primitive = document["meshes"][0]["primitives"][0];
    primitive["indices"] = 1;
    primitive["material"] = 0;
    document["materials"] = Json::parse(R"([{"doubleSided": true, "pbrMetallicRoughness": {}}])");
    return document;
}

Json glass(double transmission, const std::array<double, 4>& color, bool blend) {
    Json document = pane_document();
    Json& material = document["materials"][0];
    material["pbrMetallicRoughness"]["baseColorFactor"] = color;
    if (blend) material["alphaMode"] = "BLEND";
    if (transmission > 0.0) {
        material["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = transmission;
        document["extensionsUsed"] = document["extensionsRequired"] = {"KHR_materials_transmission"};
    }
    return document;
}

// Direct light of 1000 cd from 1 m before the asset at a point 1 m behind it, as the reference has it.
glm::dvec3 direct_behind(const std::shared_ptr<const SceneAsset>& asset, const glm::dvec2& at) {
    auto lit = std::make_shared<SceneAsset>(*asset);
    LightSeed light;
    light.name = "light";
    light.position = {at, 1.0};
    light.profile = test::isotropic(1000.0);
    lit->lights.push_back(light);
    trace::Settings settings;
    settings.bounces = 0;
    const trace::MeterPoint points[] = {{{at, -1.0}, {0, 0, 1}}};
    return trace::measure(*trace::make_world(scene_of(lit)), points, settings).front().direct_lx;
}

class Glass : public GltfFixture {};

TEST_F(Glass, APaneLetsPassWhatItsMaterialSays) {
    struct Case {
        double transmission;
        std::array<double, 4> color;
        bool blend;
        glm::dvec3 passes;
    };
    const Case cases[] = {
        {0.6, {0.9, 0.5, 0.2, 1.0}, false, {0.54, 0.30, 0.12}},
        {1.0, {1.0, 1.0, 1.0, 1.0}, false, {1, 1, 1}},
        {0.0, {0.9, 0.5, 0.2, 0.3}, true, {0.7, 0.7, 0.7}},
        {0.5, {0.8, 0.4, 0.2, 0.6}, true, {0.4 + 0.24, 0.4 + 0.12, 0.4 + 0.06}},
        {0.0, {0.9, 0.5, 0.2, 0.3}, false, {0, 0, 0}},
    };
    for (const Case& c : cases) {
        const auto asset = good(glass(c.transmission, c.color, c.blend));
        EXPECT_EQ(warns(*asset, "neither refracted nor reflected"), c.transmission > 0.0 || c.blend);
        // In the middle the light meets the edge between the pane's triangles.
        for (const glm::dvec2 at : {glm::dvec2(0.0), {0.31, -0.2}}) {
            const glm::dvec3 lux = direct_behind(asset, at);
            for (int k = 0; k < 3; ++k) EXPECT_NEAR(lux[k], 250.0 * c.passes[k], 0.001 * 250.0) << c.passes[k];
        }
    }
}

TEST_F(Glass, PanesMultiply) {
    Json document = glass(0.5, {0.8, 0.8, 0.8, 1.0}, false);
    document["nodes"].push_back({{"mesh", 0}, {"translation", {0.0, 0.0, 0.3}}});
    document["scenes"][0]["nodes"] = {0, 1};
    for (const double lux : {direct_behind(good(document), {0.2, 0.1}).g, direct_behind(good(document), {0, 0}).g})
        EXPECT_NEAR(lux, 250.0 * 0.4 * 0.4, 0.04);
    document["nodes"].push_back({{"mesh", 0}, {"translation", {0.0, 0.0, 1.2}}});  // behind the light
    document["scenes"][0]["nodes"] = {0, 1, 2};
    EXPECT_NEAR(direct_behind(good(document), {0.2, 0.1}).g, 250.0 * 0.4 * 0.4, 0.04);
}

// Alpha of vertices and of textures, the transmission texture's red, each in the middle of the pane.
TEST_F(Glass, TexturesAndVertexColoursSayHowMuchPasses) {
    Json document = glass(0.0, {1.0, 1.0, 1.0, 1.0}, true);
    document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
        add_accessor(document, bytes_of({1, 1, 1, .25f, 1, 1, 1, .25f, 1, 1, 1, .25f, 1, 1, 1, .25f}), 5126, 4, "VEC4");
    EXPECT_NEAR(direct_behind(good(document), {0.2, 0.1}).g, 250.0 * 0.75, 0.25);

    // 1 × 1 of (200, 100, 50, 128).
    document = glass(0.0, {1.0, 1.0, 1.0, 1.0}, true);
    document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] =
        add_accessor(document, bytes_of({0, 0, 1, 0, 1, 1, 0, 1}), 5126, 4, "VEC2");
    document["images"] = Json::array(
        {Json{{"uri",
               "data:image/png;base64,"
               "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR4nGM4kWLUAAAFNQHfc2Lj2wAAAABJRU5ErkJggg=="}}});
    document["textures"] = Json::parse(R"([{"source": 0}])");
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    EXPECT_NEAR(direct_behind(good(document), {0.2, 0.1}).g, 250.0 * (1.0 - 128 / 255.0), 0.25);

    document["materials"][0].erase("alphaMode");
    document["materials"][0]["pbrMetallicRoughness"].erase("baseColorTexture");
    document["materials"][0]["extensions"]["KHR_materials_transmission"] =
        Json::parse(R"({"transmissionFactor": 0.5, "transmissionTexture": {"index": 0}})");
    document["extensionsUsed"] = {"KHR_materials_transmission"};
    EXPECT_NEAR(direct_behind(good(document), {0.2, 0.1}).g, 250.0 * 0.95 * 0.5 * 200 / 255.0, 0.25);  // --max-albedo
}

// A sphere of half-open material that loses no light, around a luminaire inside a diffuse sphere: by symmetry and by
// the balance of power the wall has Φ / ((1 − ρ) 4πR²), of which the direct part is what passes.
TEST(GlassPaths, AnInnerSphereChangesOnlyTheWay) {
    constexpr double radius = 2.0, rho = 0.5, passes = 0.4;
    Piece outer{test::inward_sphere(radius, 96), glm::vec3(rho)}, inner{test::inward_sphere(0.8, 96), glm::vec3(1.0f)};
    auto asset =
        std::make_shared<SceneAsset>(*test::scene_with({outer, inner}, test::isotropic(1000.0), {0, 0, 0}).asset);
    asset->materials[1].alpha_blend = true;
    asset->materials[1].base_color.a = static_cast<float>(1.0 - passes);
    const Scene scene = scene_of(asset);
    const glm::dvec3 d = glm::normalize(glm::dvec3(0.3, -0.7, 0.5));
    const trace::MeterPoint points[] = {{d * radius * 0.999, -d}};  // the wall has facets
    trace::Settings settings;
    settings.noise = 0.012;
    const trace::Reading reading = trace::measure(*trace::make_world(scene), points, settings).front();
    const double first = scene.lights[0].profile->flux_lm / (4 * std::numbers::pi * radius * radius);
    EXPECT_NEAR(reading.direct_lx.g, passes * first, 0.001 * first);
    EXPECT_NEAR(reading.direct_lx.g + reading.indirect_lx.g, first / (1.0 - rho), 0.03 * first / (1.0 - rho));
}

// White furnace with a pane of whatever share that loses no light: the luminance everywhere stays ε/(1 − ρ).
TEST(GlassPaths, AFurnaceDoesNotSeeAPane) {
    constexpr double rho = 0.5;
    Piece room{test::inward_sphere(1.0, 64), glm::vec3(rho), glm::vec3(100.0f)},
        pane{test::quad({-0.6, -0.6, 0.1}, {0.6, -0.6, 0.1}, {0.6, 0.6, 0.1}, {-0.6, 0.6, 0.1}), glm::vec3(1.0f)};
    auto asset = std::make_shared<SceneAsset>(*test::scene_with({room, pane}, test::isotropic(1.0), {0, 0, 0}).asset);
    asset->materials[1].alpha_blend = true;
    asset->materials[1].base_color.a = 0.7f;
    Scene scene = scene_of(asset);
    scene.lights[0].level_ratio = 0.0;
    const trace::MeterPoint points[] = {{{0.2, -0.1, -0.1}, {0, 0, 1}}};
    trace::Settings settings;
    settings.noise = 0.002;
    const trace::Reading reading = trace::measure(*trace::make_world(scene), points, settings).front();
    const double all = std::numbers::pi * 100.0 / (1.0 - rho);
    EXPECT_NEAR(reading.direct_lx.g + reading.indirect_lx.g, all, 0.006 * all);
}

// Every triangle takes each sixteenth once, and panes behind each other are independent.
TEST(PassThreshold, IsStratifiedAndIndependent) {
    constexpr std::uint32_t kTriangles = 4096;
    double both = 0.0;
    for (std::uint32_t triangle = 0; triangle < kTriangles; ++triangle) {
        std::set<float> seen;
        for (int sample = 0; sample < 16; ++sample) {
            const float own = glsl::pass_threshold(triangle, sample);
            seen.insert(own);
            both += own < 0.5f && glsl::pass_threshold(triangle + 1, sample) < 0.5f ? 1.0 : 0.0;
        }
        ASSERT_EQ(seen.size(), 16u) << triangle;
        ASSERT_FLOAT_EQ(*seen.begin(), 0.5f / 16.0f);
        ASSERT_FLOAT_EQ(*seen.rbegin(), 15.5f / 16.0f);
    }
    EXPECT_NEAR(both / (16.0 * kTriangles), 0.25, 0.005);
    EXPECT_EQ(glsl::pass_threshold(7, -1), 0.5f);
}

// A pane at z = 0.5 before a grey wall at z = 0.
std::shared_ptr<const SceneAsset> before_a_wall(const Material& pane) {
    const auto square = [](double z) { return test::quad({-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}); };
    auto asset =
        std::make_shared<SceneAsset>(*test::scene_with({{square(0.0), glm::vec3(0.4f)}, {square(0.5), glm::vec3(0.0f)}},
                                                       test::isotropic(1.0), {0, 0, 4})
                                          .asset);
    asset->materials[1] = pane;
    return asset;
}

// Albedo of the picture's pixels in a sample. aside: of the eye, m; at 0 the pane's diagonal runs through pixels'
// centres.
std::vector<glm::vec3> albedo_of(const std::shared_ptr<const SceneAsset>& asset, int pane_sample, double aside = 0.0) {
    constexpr int kSide = 32;
    const trace::Geometry geometry(asset);
    lighting::GBuffer gbuffer;
    lighting::Raster raster;
    Pool pool;
    lighting::look_through(eye_of({{aside, 0, 2.0}, {aside, 0, 0}, 0.5}, kSide, kSide), geometry, 1e-4f, kSide, kSide,
                           gbuffer);
    lighting::draw_gbuffer(lighting::make_clusters(geometry), lighting::make_material_table(geometry), false, gbuffer,
                           raster, pool, {pane_sample});
    std::vector<glm::vec3> found;
    for (std::size_t y = 0; y < kSide; ++y) {
        for (std::size_t x = 0; x < kSide; ++x) {
            const std::uint16_t* halves = &raster.albedo[4 * (y * gbuffer.row_length + x)];
            found.emplace_back(glm::unpackHalf1x16(halves[0]), glm::unpackHalf1x16(halves[1]),
                               glm::unpackHalf1x16(halves[2]));
        }
    }
    return found;
}

// What is seen through coloured glass has its colour, on the edge between its triangles too.
TEST(GlassPicture, ColouredGlassTintsWhatIsSeen) {
    Material pane;
    pane.base_color = {0.9f, 0.5f, 0.25f, 1.0f};
    pane.transmission = 1.0f;
    for (const glm::vec3& albedo : albedo_of(before_a_wall(pane), -1)) {
        for (int k = 0; k < 3; ++k) ASSERT_NEAR(albedo[k], 0.4f * pane.base_color[k], 2e-3f);
    }
}

// Sixteen samples show each surface as often as the pane says; a single one shows that of the greater share.
TEST(GlassPicture, SamplesAverageToCoverage) {
    Material pane;
    pane.base_color = {0.8f, 0.8f, 0.8f, 5.0f / 16.0f};
    pane.alpha_blend = true;
    const auto asset = before_a_wall(pane);
    std::vector<glm::vec3> sum(32 * 32, glm::vec3(0.0f));
    for (int sample = 0; sample < 16; ++sample) {
        const auto one = albedo_of(asset, sample, 0.003);
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += one[i] / 16.0f;
    }
    const float expected = 0.8f * 5.0f / 16.0f + 0.4f * 11.0f / 16.0f;
    for (const glm::vec3& mean : sum) ASSERT_NEAR(mean.r, expected, 2e-3f);
    for (const glm::vec3& seen : albedo_of(asset, -1)) ASSERT_NEAR(seen.r, 0.4f, 1e-3f);
}

// The reference looks through coloured glass at a wall that is lit through it.
TEST(GlassPicture, TheReferenceSeesThroughColour) {
    Material pane;
    pane.base_color = {0.9f, 0.5f, 0.25f, 1.0f};
    pane.transmission = 0.8f;
    const auto asset = before_a_wall(pane);
    trace::PictureRequest request;
    request.camera = {{0, 0, 2.0}, {0, 0, 0}, 0.05};
    request.width_px = request.height_px = 8;
    trace::Settings settings;
    settings.bounces = 0;
    settings.noise = 0.012;
    trace::Picture picture(trace::make_world(scene_of(asset)), request, settings);
    while (!picture.refine(10.0).complete) {
    }
    glm::dvec3 mean(0.0);
    const std::vector<float> values = picture.values();
    for (std::size_t i = 0; i < 64; ++i) {
        for (std::size_t k = 0; k < 3; ++k) mean[static_cast<int>(k)] += static_cast<double>(values[4 * i + k]) / 64.0;
    }
    for (int k = 0; k < 3; ++k) {
        const double c = static_cast<double>(pane.base_color[k]), on_wall = 0.8 * c * 1.0 / 16.0,
                     on_pane = 1.0 / (3.5 * 3.5);
        const double expected = (0.8 * c * 0.4 * on_wall + 0.2 * c * on_pane) / std::numbers::pi;
        EXPECT_NEAR(mean[k], expected, 0.02 * expected) << k;
    }
}

}  // namespace
}  // namespace gonio
