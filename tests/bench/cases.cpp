#include "tests/bench/cases.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/opening.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "tests/scenes/bench_scenes.h"
#include "tests/scenes/scenes.h"

namespace gonio::bench {
namespace {

// The test profiles of one-luminaire scenes. aim: of the beams, so that it strikes an edge (cornell), the colonnade
// (atrium), the doorway (corridor).
struct Lighting {
    const char* scene;
    double candela;
    glm::dvec3 aim;
};
const Lighting kLightings[] = {{"cornell", 1000.0, {-0.9, -1.0, -0.35}},
                               {"atrium", 4000.0, {0.7, -1.0, 0.55}},
                               {"corridor", 800.0, {2.27, -1.85, -0.8}}};

// times: its candela over those of "wide". cos^power has half of them at so many degrees across.
struct Shape {
    const char* profile;
    double times, power;
    bool everywhere;  // in the corridor too
};
constexpr Shape kShapes[] = {{"wide", 1.0, 2.0, true},
                             {"beam", 10.0, 30.0, true},
                             {"beam12", 40.0, 125.0, false},
                             {"beam6", 40.0, 500.0, false}};

// Neighbours share the vertices in the middle of their edges.
void split(Mesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        const auto [found, fresh] =
            middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.vertices.size()));
        if (fresh) {
            const Vertex p = mesh.vertices[a], q = mesh.vertices[b];
            const glm::vec3 normal = p.normal + q.normal;
            mesh.vertices.push_back({0.5f * (p.position + q.position),
                                     glm::dot(normal, normal) > 0.0f ? glm::normalize(normal) : p.normal,
                                     0.5f * (p.uv + q.uv)});
        }
        return found->second;
    };
    std::vector<std::uint32_t> indices;
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const std::uint32_t a = mesh.indices[i], b = mesh.indices[i + 1], c = mesh.indices[i + 2], ab = middle(a, b),
                            bc = middle(b, c), ca = middle(c, a);
        indices.insert(indices.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
    }
    mesh.indices = std::move(indices);
}

}  // namespace

std::shared_ptr<const SceneAsset> split_triangles(const SceneAsset& asset, int times) {
    auto result = std::make_shared<SceneAsset>(asset);
    for (Mesh& mesh : result->meshes) {
        for (int i = 0; i < times; ++i) split(mesh);
    }
    return result;
}

std::shared_ptr<const SceneAsset> bench_asset(const std::string& name) {
    if (name == "corridor") return test::make_corridor();
    if (name == "stage") return test::make_stage(4);
    const auto asset = load_scene(name);
    if (!asset) throw std::runtime_error(asset.error().text());
    if ((*asset)->lights.empty()) throw std::runtime_error("the scene '" + name + "' has no luminaire to measure with");
    return *asset;
}

std::vector<Case> bench_cases(const std::string& scene) {
    std::vector<Case> cases;
    for (const Lighting& lighting : kLightings) {
        for (const Shape& shape : kShapes) {
            if (shape.everywhere || std::string_view(lighting.scene) != "corridor")
                cases.push_back({lighting.scene, shape.profile, 0});
        }
    }
    for (const int side : {1, 2, 4, 8}) cases.push_back({"stage", "downlight", side});
    if (scene.empty()) return cases;
    std::erase_if(cases, [&](const Case& c) { return c.scene != scene; });
    if (cases.empty()) cases.push_back({scene, "own", 0});
    return cases;
}

Scene scene_of_case(const Case& which) {
    Scene scene = scene_of(which.side > 0 ? test::make_stage(which.side) : bench_asset(which.scene));
    scene.width_px = scene.height_px = 800;
    const bool panel = which.profile == "panel", hazy = which.profile == "haze";
    const std::string profile = panel || hazy ? "wide" : which.profile;
    if (hazy) scene.haze = {.extinction_per_m = 0.01};  // "show"
    // Rows of points stay comparable.
    const ies::Opening opening = panel ? *parse_opening("rect 0.6x0.6") : ies::Opening();
    for (Light& light : scene.lights) light.opening = opening;
    for (const Lighting& lighting : kLightings) {
        for (const Shape& shape : kShapes) {
            if (which.scene != lighting.scene || profile != shape.profile) continue;
            for (Light& light : scene.lights) {
                light.profile = test::cosine_power(shape.times * lighting.candela, shape.power);
                light.world_from_light = orientation_aiming(profile == "wide" ? glm::dvec3(0, -1, 0) : lighting.aim);
            }
        }
    }
    return scene;
}

}  // namespace gonio::bench
