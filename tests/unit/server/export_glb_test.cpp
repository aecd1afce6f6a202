// A scene as .glb: what stands in it, and that it comes back with the same light.
#include "server/exchange/export_glb.h"

#include <gtest/gtest.h>

#include <cstring>
#include <glm/gtc/matrix_transform.hpp>
#include <nlohmann/json.hpp>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/exchange/export_light.h"
#include "server/scene/scene.h"
#include "server/session/null_renderer.h"
#include "server/session/render_session.h"
#include "tests/unit/export_fixture.h"

namespace gonio::test {
namespace {

using Json = nlohmann::json;

std::uint32_t word_at(const std::string& bytes, std::size_t at) {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + at, 4);
    return word;
}

struct Parts {
    Json document;
    std::string binary;
    std::string view(std::size_t index) const {
        const Json& view = document["bufferViews"][index];
        return binary.substr(view["byteOffset"], view["byteLength"]);
    }
    const Json& node(const std::string& name) const {
        for (const Json& node : document["nodes"])
            if (node["name"] == name) return node;
        ADD_FAILURE() << name;
        return document["nodes"][0];
    }
};

Parts parts_of(const std::string& bytes) {
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(word_at(bytes, 8), bytes.size());
    const std::size_t json = word_at(bytes, 12);
    EXPECT_EQ(bytes.substr(20 + json + 4, 4), std::string("BIN\0", 4));
    return {Json::parse(bytes.substr(20, json)), bytes.substr(28 + json)};
}

std::string glb_of(const Scene& scene) {
    auto bytes = exchange::export_glb(scene);
    EXPECT_TRUE(bytes) << bytes.error().text();
    return bytes ? *bytes : std::string();
}

std::shared_ptr<const SceneAsset> read_again(const std::string& bytes) {
    std::size_t room = std::size_t{1} << 32;
    auto read = read_glb(std::as_bytes(std::span(bytes)), "again.glb", {}, room);
    EXPECT_TRUE(read) << read.error().text();
    return *read;
}

class ExportGlb : public testing::TestWithParam<const char*> {};

TEST_P(ExportGlb, ComesBackWithTheSameLight) {
    const Scene scene = rigged(*load_scene(GetParam()));
    const auto asset = read_again(glb_of(scene));
    EXPECT_EQ(asset->triangles(), scene.asset->triangles());
    EXPECT_EQ(asset->instances.size(), scene.asset->instances.size());
    ASSERT_EQ(asset->lights.size(), scene.lights.size());
    for (std::size_t i = 0; i < asset->lights.size(); ++i) {
        const LightSeed& is = asset->lights[i];
        const Light& was = scene.lights[i];
        EXPECT_EQ(is.name, was.name);
        EXPECT_EQ(is.sun, was.sun);
        EXPECT_NEAR(glm::length(is.position - was.position), 0.0, 1e-9);
        EXPECT_NEAR(glm::length(aim_of(is.world_from_light) - aim_of(was.world_from_light)), 0.0, 1e-9);
        EXPECT_NEAR(glm::length(c0_of(is.world_from_light) - c0_of(was.world_from_light)), 0.0, 1e-9);
    }
    for (const std::string& warning : asset->warnings) EXPECT_EQ(warning.find("light"), std::string::npos) << warning;
    expect_same_light(scene, scene_of(asset));
}
INSTANTIATE_TEST_SUITE_P(BuiltIn, ExportGlb, testing::Values("cornell", "atrium", "cylinder"));

// E = I(v, c) cos v / d² by hand, of a luminaire 2 m above the floor: roll turns C0 to the azimuth roll, C90 is -Z.
TEST(ExportedGlb, AnAsymmetricWebKeepsItsAzimuth) {
    const double roll = 50.0 * kDegree;
    Scene scene = floor_scene(20.0, 0.5f, lopsided(), {0, 2, 0}, orientation_of({0.0, 0.0, roll}));
    scene.lights[0].level_ratio = 0.5;
    scene.lights[0].multiplier = 3.0;
    scene.lights[0].color = {0.8, 0.4, 0.2};
    scene.master_ratio = 0.9;
    const Scene again = scene_of(read_again(glb_of(scene)));
    EXPECT_NEAR(again.lights.at(0).level_ratio, 0.5 * 0.9, 1e-12);
    EXPECT_NEAR(again.lights[0].multiplier, 3.0 * 0.8, 1e-12);
    EXPECT_EQ(again.lights[0].color.r, 1.0);
    std::vector<trace::MeterPoint> points;
    for (const double azimuth : {0.0, 50.0, 140.0, 230.0, 300.0})
        points.push_back({{1.5 * std::cos(azimuth * kDegree), 0, -1.5 * std::sin(azimuth * kDegree)}, {0, 1, 0}});
    const auto readings = readings_of(again, points);
    const double v = std::atan2(1.5, 2.0), d2 = 1.5 * 1.5 + 4.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double c = std::atan2(-points[i].position.z, points[i].position.x) - roll;
        const double cd_here = 200.0 * (2.0 + std::sin(v) * std::cos(c)) * (1.0 + std::cos(v));
        for (int k = 0; k < 3; ++k) {
            const double weight = 0.5 * 3.0 * 0.9 * scene.lights[0].color[k];
            EXPECT_NEAR(readings[i].direct_lx[k] / (weight * cd_here * std::cos(v) / d2), 1.0, 1e-3) << i;
        }
    }
}

// What the extensions ask for: absolute candela with TILT and ballast factor, colours of at most 1, and beside a
// measured light a punctual one for programs that know no other.
TEST(ExportedGlb, LightsAreAsTheExtensionsHaveThem) {
    Scene scene = rigged(make_cornell());
    scene.lights.resize(1);
    Light tilted =
        light_of(scene, "tilted", *make_profile("tilting.ies", tilting_lm63()), {0, 1, 0}, {0.0, 90.0 * kDegree, 0.0});
    tilted.tilt_factor = 0.6;
    tilted.color = {4.0, 2.0, 1.0};
    scene.lights.push_back(tilted);
    tilted.name = "the same";
    scene.lights.push_back(tilted);
    tilted.name = "dark";
    tilted.level_ratio = 0.0;
    scene.lights.push_back(tilted);
    scene.lights.push_back(light_of(scene, "spot", punctual_spot_profile(0.2, 0.7), {0, 1, 0}));
    scene.lights.back().multiplier = 500.0;
    scene.lights.push_back(light_of(scene, "sun", sun_profile(), {0, 1, 0}));
    scene.lights.back().sun = true;
    scene.lights.back().multiplier = 1000.0;
    scene.master_ratio = 0.5;
    scene.camera = {{1, 2, 3}, {0, 1, 0}, 0.9};
    const std::string bytes = glb_of(scene);
    const Parts parts = parts_of(bytes);
    const Json& document = parts.document;
    const auto again = read_again(bytes);
    EXPECT_EQ(again->lights.at(3).level_ratio, 0.0) << "what is dark can be lit again";
    EXPECT_EQ(again->lights[3].multiplier, 4.0);
    EXPECT_EQ(again->lights[4].level_ratio, 0.5) << "the master";
    ASSERT_EQ(document["extensions"]["EXT_lights_ies"]["lights"].size(), 2u) << "the same web is there once";
    const Json& use = parts.node("tilted")["extensions"]["EXT_lights_ies"];
    EXPECT_EQ(use, parts.node("the same")["extensions"]["EXT_lights_ies"]);
    EXPECT_EQ(use["multiplier"], 0.5 * 4.0);
    EXPECT_EQ(use["color"], Json({1.0, 0.5, 0.25}));
    EXPECT_EQ(parts.node("dark")["extensions"]["EXT_lights_ies"]["multiplier"], 0.0);
    const Json& light = document["extensions"]["EXT_lights_ies"]["lights"][use["light"].get<std::size_t>()];
    EXPECT_EQ(light["mimeType"], "application/x-ies-lm-63");
    const std::string text = parts.view(light["bufferView"]);
    EXPECT_EQ(text.substr(0, text.find("\r\n")), "IES:LM-63-2019");
    EXPECT_NE(text.find("\r\nTILT=NONE\r\n"), std::string::npos);
    // -1 lumens: absolute. 1000 cd · 0.9 · 0.6, and so on.
    EXPECT_NE(text.find("\r\n1 -1 1 3 1 1 2 0 0 0\r\n"), std::string::npos) << text;
    EXPECT_NE(text.find("\r\n540 270 54\r\n"), std::string::npos) << text;
    // Aimed along -Z: the node's own axes are the world's.
    const Json rotation = parts.node("tilted")["rotation"];
    EXPECT_NEAR(std::abs(rotation[3].get<double>()), 1.0, 1e-12);
    const auto punctual = [&](const char* name) {
        const Json& node = parts.node(name);
        return document["extensions"]["KHR_lights_punctual"]["lights"]
                       [node["extensions"]["KHR_lights_punctual"]["light"].get<std::size_t>()];
    };
    EXPECT_EQ(punctual("spot")["type"], "spot");
    EXPECT_NEAR(punctual("spot")["spot"]["innerConeAngle"], 0.2, 1e-9);
    EXPECT_NEAR(punctual("spot")["spot"]["outerConeAngle"], 0.7, 1e-9);
    EXPECT_EQ(punctual("spot")["intensity"], 250.0);
    EXPECT_EQ(punctual("sun")["type"], "directional");
    EXPECT_EQ(punctual("sun")["intensity"], 500.0);
    EXPECT_EQ(punctual("dark")["intensity"], 0.0);
    for (const char* name : {"spot", "sun"}) EXPECT_EQ(parts.node(name)["extensions"].size(), 1u) << name;
    for (const char* name : {"tilted", "dark"}) EXPECT_EQ(parts.node(name)["extensions"].size(), 2u) << name;
    for (const std::string& warning : again->warnings) EXPECT_EQ(warning.find("punctual"), warning.npos) << warning;
    EXPECT_EQ(document["cameras"][0]["perspective"]["yfov"], 0.9);
    EXPECT_EQ(parts.node("camera")["translation"], Json({1.0, 2.0, 3.0}));
    EXPECT_EQ(document["extensionsUsed"], Json({"EXT_lights_ies", "KHR_lights_punctual"}));
    EXPECT_FALSE(document.contains("extensionsRequired"));
}

// A lamp of 100 cd within 60 degrees has 2 pi (1 - cos 60°) 100 = 100 pi lm, half of them within acos(1 - 0.25). What
// KHR_lights_punctual says of a spot has the solid angle 2 pi ((1 - cos i) + (cos i - cos o) / 3).
TEST(ExportedGlb, TheLightBesideAMeasuredOneHasItsFlux) {
    const auto lamp_of = [](double within_deg, float candela) {  // the same in all these directions
        auto profile = std::make_shared<Profile>(*punctual_point_profile());
        ies::PhotometricWeb& web = profile->photometry.web;
        web.v_rad = {0.0, within_deg * kDegree};
        web.h_rad = {0.0, 2.0 * ies::kPi};
        web.candela.assign(4, candela);
        return floor_scene(4.0, 0.5f, profile, {0, 2, 0}).lights[0];
    };
    const auto even = exchange::fallback_of(lamp_of(60, 100));
    EXPECT_STREQ(even.light.type, "spot");
    EXPECT_NEAR(even.light.inner_rad, std::acos(0.75), 0.02 * kDegree);
    EXPECT_NEAR(even.light.outer_rad, std::acos(1.0 - 0.95 * 0.5), 0.02 * kDegree);
    const double inner = std::cos(even.light.inner_rad), outer = std::cos(even.light.outer_rad);
    EXPECT_NEAR(even.cd * 2.0 * ies::kPi * ((1.0 - inner) + (inner - outer) / 3.0), 100.0 * ies::kPi, 1e-6);
    const auto bulb = exchange::fallback_of(lamp_of(180, 100));
    EXPECT_STREQ(bulb.light.type, "point");
    EXPECT_NEAR(bulb.cd, 100.0, 1e-6);
    EXPECT_EQ(exchange::fallback_of(lamp_of(90, 0)).cd, 0.0);
}

TEST(ExportedGlb, AClosedShutterIsDarkAndCanBeLit) {
    expect_a_closed_shutter_back([](const Scene& scene) { return scene_of(read_again(glb_of(scene))); });
}

TEST(ExportedGlb, APunctualLightWithAnOpeningIsMeasured) {
    Scene scene = floor_scene(4.0, 0.5f, punctual_point_profile(), {0, 2, 0});
    scene.lights[0].opening = ies::Opening{ies::OpeningShape::ellipse, 0.5 * m, 0.5 * m, 0.0 * m};
    const auto asset = read_again(glb_of(scene));
    EXPECT_EQ(asset->lights.at(0).profile->photometry.opening, *scene.lights[0].opening);
}

// All that a material, a mesh and an instance can have.
TEST(ExportedGlb, GeometryAndMaterialsComeBack) {
    auto asset = std::make_shared<SceneAsset>();
    asset->name = "parts";
    for (const bool linear : {false, true, false}) {
        Image image{2, 2, {10, 20, 30, 255, 40, 50, 60, 255, 70, 80, 90, 128, 250, 255, 255, 255}, linear};
        image.rgba[0] = static_cast<std::uint8_t>(image.rgba[0] + asset->images.size());
        asset->images.push_back(std::move(image));
    }
    Material material;
    material.name = "all";
    material.base_color = {0.9f, 0.8f, 0.7f, 0.6f};
    material.base_color_image = 0;
    material.wrap_s = Wrap::clamp;
    material.wrap_t = Wrap::mirror;
    material.emissive_nit = {300.0f, 20.0f, 0.5f};
    material.emissive_image = 2;
    material.normal_image = 1;
    material.normal_scale = 0.5f;
    material.alpha_blend = true;
    material.transmission = 0.25f;
    material.double_sided = true;
    asset->materials.emplace_back().name = "not used";
    asset->materials.push_back(material);
    Material masked;
    masked.name = "masked";
    masked.base_color = {0.3f, 0.3f, 0.3f, 1.0f};
    masked.alpha_mask = true;
    masked.alpha_cutoff = 0.4f;
    masked.emissive_nit = glm::vec3(0.25f);
    asset->materials.push_back(masked);
    Mesh mesh = quad({0, 0, 1}, {1, 0, 1}, {1, 0, 0}, {0, 0, 0});
    mesh.material = 1;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        mesh.vertices[i].uv = {0.25f * static_cast<float>(i), 1.5f};
        mesh.colors.emplace_back(65535 - 100 * i, 1000 * i, 7, 40000);
        mesh.tangents.emplace_back(1, 0, 0, i % 2 == 0 ? 1 : -1);
        mesh.second_uv.emplace_back(0.1f * static_cast<float>(i), 0.2f);
    }
    asset->meshes.push_back(mesh);
    Mesh plain = quad({0, 0, 1}, {2, 0, 1}, {2, 0, 0}, {0, 0, 0});
    plain.material = 2;
    asset->meshes.push_back(plain);
    const glm::dmat4 turned = glm::rotate(glm::dmat4(1.0), 0.3, glm::dvec3(1, 2, 3));
    asset->instances = {{1, glm::translate(glm::dmat4(1.0), {0.1, 0.2, 0.3}), "first"},
                        {0, turned, "second"},
                        {1, glm::scale(turned, {-2, 1, 1}), "mirrored"}};
    asset->bounds = {glm::dvec3(-3), glm::dvec3(3)};
    const auto again = read_again(glb_of(scene_of(asset)));
    ASSERT_EQ(again->instances.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        const Instance &is = again->instances[i], &was = asset->instances[i];
        EXPECT_EQ(is.node, was.node);
        EXPECT_EQ(is.world_from_mesh, was.world_from_mesh);
        const Mesh &there = again->meshes[static_cast<std::size_t>(is.mesh)],
                   &here = asset->meshes[static_cast<std::size_t>(was.mesh)];
        ASSERT_EQ(there.indices.size(), here.indices.size());
        for (std::size_t k = 0; k < here.indices.size(); ++k) {
            const std::size_t a = there.indices[k], b = here.indices[k];
            EXPECT_EQ(there.vertices[a].position, here.vertices[b].position);
            EXPECT_NEAR(glm::length(there.vertices[a].normal - here.vertices[b].normal), 0.0f, 1e-6f) << i;
            EXPECT_EQ(there.vertices[a].uv, here.vertices[b].uv);
            ASSERT_EQ(there.colors.size(), here.colors.size());
            if (!here.colors.empty()) {
                EXPECT_EQ(there.colors[a], here.colors[b]);
                EXPECT_EQ(there.tangents[a], here.tangents[b]);
                EXPECT_EQ(there.second_uv[a], here.second_uv[b]);
            }
        }
        const Material &made = again->materials[static_cast<std::size_t>(there.material)],
                       &from = asset->materials[static_cast<std::size_t>(here.material)];
        EXPECT_EQ(made.name, from.name);
        EXPECT_EQ(made.base_color, from.base_color);
        for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(made.emissive_nit[c], from.emissive_nit[c]);
        EXPECT_EQ(made.wrap_s, from.wrap_s);
        EXPECT_EQ(made.wrap_t, from.wrap_t);
        EXPECT_EQ(made.normal_scale, from.normal_scale);
        EXPECT_EQ(made.alpha_blend, from.alpha_blend);
        EXPECT_EQ(made.alpha_mask, from.alpha_mask);
        EXPECT_EQ(made.alpha_cutoff, from.alpha_cutoff);
        EXPECT_EQ(made.transmission, from.transmission);
        EXPECT_EQ(made.double_sided, from.double_sided);
        for (const auto image : {&Material::base_color_image, &Material::emissive_image, &Material::normal_image}) {
            ASSERT_EQ(made.*image >= 0, from.*image >= 0);
            if (from.*image < 0) continue;
            const Image &is_image = again->images[static_cast<std::size_t>(made.*image)],
                        &was_image = asset->images[static_cast<std::size_t>(from.*image)];
            EXPECT_EQ(is_image.rgba, was_image.rgba);
            EXPECT_EQ(is_image.linear, was_image.linear);
        }
    }
    for (const std::string& warning : again->warnings)
        EXPECT_EQ(warning.find("--max-albedo"), std::string::npos) << "bright texels are times a darker factor";
    EXPECT_EQ(again->materials.size(), 3u) << "those that are used, and glTF's default";
}

TEST(ExportedGlb, ASceneWithoutSurfacesHasItsLightsAlone) {
    auto asset = std::make_shared<SceneAsset>();
    asset->materials.emplace_back();
    Scene scene = scene_of(asset);
    scene.lights.push_back(light_of(scene, "bulb", punctual_point_profile(), {1, 2, 3}));
    const std::string bytes = glb_of(scene);
    EXPECT_EQ(bytes.find("null"), std::string::npos) << "no number that is none";
    const auto again = read_again(bytes);
    EXPECT_EQ(again->lights.at(0).name, "bulb");
    EXPECT_TRUE(again->cameras.empty());
}

TEST(ExportedGlb, WhatGltfCannotHoldIsRefused) {
    Scene scene = floor_scene(4.0, 0.5f, lopsided(), {0, 2, 0});
    scene.lights[0].name = "glaring";
    scene.lights[0].multiplier = 1e9;
    scene.lights[0].color = glm::dvec3(2.0);
    const auto refused = exchange::export_glb(scene);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "too_large");
    EXPECT_EQ(refused.error().where, "glaring");
    scene.lights[0].multiplier = 5e8;
    EXPECT_TRUE(exchange::export_glb(scene));
}

// The session: as a capture whose format is a scene's.
class SavesScenes : public testing::Test {
protected:
    void SetUp() override { start(scene_of(make_cornell())); }
    void start(Scene scene) {
        SessionOutputs outputs;
        outputs.reply = [this](std::uint32_t, v1::ServerMessage message) { replies.push(std::move(message)); };
        outputs.state = [](v1::State, v1::StateChanged) {};
        outputs.picture = [](Picture) {};
        outputs.gone = [](std::uint32_t) {};
        session.emplace(std::make_unique<NullRenderer>(), std::move(scene), "null", queue, loader, std::move(outputs));
    }
    void ask(std::uint32_t request_id, const std::string& format, const std::string& view = "") {
        Work work;
        work.session = 1;
        work.message.set_request_id(request_id);
        work.message.mutable_capture()->set_format(format);
        work.message.mutable_capture()->set_view(view);
        session->take(std::move(work));
    }
    Queue<v1::ServerMessage> replies{1000};
    Queue<Work> queue{100};
    Loader loader;
    std::optional<RenderSession> session;
};

TEST_F(SavesScenes, AsAFileThatReadsBack) {
    ask(7, "glb");
    const auto reply = replies.pop_for(std::chrono::seconds(30));
    ASSERT_TRUE(reply && reply->has_capture());
    EXPECT_EQ(reply->request_id(), 7u);
    EXPECT_EQ(reply->capture().format(), "glb");
    EXPECT_EQ(reply->capture().scene_rev(), 1u);
    EXPECT_EQ(read_again(reply->capture().image())->lights.size(), 1u);
    EXPECT_FALSE(session->waits()) << "frames do not wait for it";
    ask(8, "mvr");
    const auto show = replies.pop_for(std::chrono::seconds(30));
    ASSERT_TRUE(show && show->has_capture());
    EXPECT_EQ(show->capture().image().substr(0, 2), "PK");
    EXPECT_EQ(show->capture().warnings_size(), 0) << "nothing is left out";
}

TEST_F(SavesScenes, AndSaysWhatIsLeftOut) {
    start(rigged(make_cornell()));
    ask(9, "mvr");
    const auto show = replies.pop_for(std::chrono::seconds(30));
    ASSERT_TRUE(show && show->has_capture());
    ASSERT_EQ(show->capture().warnings_size(), 2);
    EXPECT_EQ(show->capture().warnings(0), "left out: suns, and their light: \"sun\"");
}

TEST_F(SavesScenes, NoMoreAtOnceThanItsBoundAndNothingBeside) {
    ask(1, "glb", "beauty");
    auto reply = replies.pop_for(std::chrono::seconds(1));
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->result().code(), "unsupported");
    EXPECT_EQ(reply->result().field(), "capture.format");
    for (std::uint32_t id = 1; id <= 100; ++id) ask(id, "glb");
    int busy = 0, done = 0;
    for (int i = 0; i < 100; ++i) {
        reply = replies.pop_for(std::chrono::seconds(30));
        ASSERT_TRUE(reply);
        reply->has_capture() ? ++done : ++busy;
        EXPECT_EQ(reply->result().code(), reply->has_capture() ? "" : "busy");
    }
    EXPECT_GE(done, static_cast<int>(kMaxSceneFiles));
    EXPECT_GT(busy, 0);
    ask(200, "glb");
    reply = replies.pop_for(std::chrono::seconds(30));
    ASSERT_TRUE(reply && reply->has_capture()) << "then there is room again";
}

}  // namespace
}  // namespace gonio::test
