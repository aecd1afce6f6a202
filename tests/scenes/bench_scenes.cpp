#include "tests/scenes/bench_scenes.h"

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "server/assets/assets.h"
#include "server/assets/mesh_builder.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"

namespace gonio::test {
namespace {

void add_piece(SceneAsset& scene, const char* name, const glm::vec3& reflectance, Mesh mesh,
               const glm::dmat4& transform = glm::dmat4(1.0)) {
    const int material = add_material(scene, name, reflectance);
    add_instance(scene, add_mesh(scene, std::move(mesh), material), name, transform);
}

Mesh box(const glm::dvec3& min, const glm::dvec3& max, unsigned left_out = 0) {
    Mesh mesh;
    add_box(mesh, min, max, left_out);
    return mesh;
}

Mesh flat(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
    Mesh mesh;
    add_quad(mesh, a, b, c, d);
    return mesh;
}

Mesh column(double radius_m, double height_m) {
    Mesh mesh;
    add_lathe(mesh, {{radius_m, 0.0}, {radius_m, height_m}, {0.0, height_m}}, 48);
    return mesh;
}

Mesh ball(double radius_m) {
    Mesh mesh;
    add_surface(
        mesh,
        [=](double u, double v) {
            const double phi = 2.0 * std::numbers::pi * u, theta = std::numbers::pi * (1.0 - v);
            return radius_m *
                   glm::dvec3(std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi));
        },
        64, 32, true, false);
    return mesh;
}

glm::dmat4 at(double x, double y, double z) {
    return glm::translate(glm::dmat4(1.0), {x, y, z});
}

LightSeed luminaire(std::string name, const glm::dvec3& position, const glm::dvec3& aim, const char* profile,
                    double multiplier) {
    LightSeed light;
    light.name = std::move(name);
    light.position = position;
    light.world_from_light = orientation_aiming(aim);
    light.multiplier = multiplier;
    if (auto made = builtin_profile(profile)) light.profile = *made;
    return light;
}

}  // namespace

std::shared_ptr<const SceneAsset> make_corridor() {
    constexpr double x = 4.0, y = 3.0, z = 1.6;  // half length, height, half width
    constexpr double wall = 0.15, out = 0.002;   // the partition reaches this far into walls, floor and ceiling
    constexpr double left = -1.2, right = -0.2, top = 2.1;  // doorway
    auto scene = std::make_shared<SceneAsset>();
    scene->name = "corridor";
    add_piece(*scene, "floor", {0.42f, 0.34f, 0.26f}, flat({-x, 0, z}, {x, 0, z}, {x, 0, -z}, {-x, 0, -z}));
    add_piece(*scene, "ceiling", glm::vec3(0.8f), flat({-x, y, -z}, {x, y, -z}, {x, y, z}, {-x, y, z}));
    add_piece(*scene, "back wall", glm::vec3(0.7f), flat({-x, 0, -z}, {x, 0, -z}, {x, y, -z}, {-x, y, -z}));
    add_piece(*scene, "front wall", glm::vec3(0.7f), flat({x, 0, z}, {-x, 0, z}, {-x, y, z}, {x, y, z}));
    add_piece(*scene, "near end", {0.65f, 0.25f, 0.10f}, flat({-x, 0, z}, {-x, 0, -z}, {-x, y, -z}, {-x, y, z}));
    add_piece(*scene, "far end", {0.20f, 0.32f, 0.62f}, flat({x, 0, -z}, {x, 0, z}, {x, y, z}, {x, y, -z}));
    Mesh partition = box({0, -out, -z - out}, {wall, y + out, left});
    add_box(partition, {0, -out, right}, {wall, y + out, z + out});
    add_box(partition, {0, top, left}, {wall, y + out, right});
    add_piece(*scene, "partition", glm::vec3(0.7f), std::move(partition));
    add_piece(*scene, "bench", {0.5f, 0.36f, 0.2f}, box({1.6, 0, -1.55}, {3.2, 0.45, -1.05}, kNoBottom));
    add_piece(*scene, "cupboard", {0.3f, 0.42f, 0.3f}, box({-3.3, 0, -1.55}, {-2.3, 1.3, -1.0}, kNoBottom));
    add_piece(*scene, "column", glm::vec3(0.72f), column(0.18, y), at(2.3, 0, 0.6));
    scene->lights.push_back(luminaire("luminaire", {-2.2, y - 0.15, 0.1}, {0, -1, 0}, "downlight", 1.0));
    scene->cameras.push_back({{1.2, 8.0, 8.6}, {0.0, 1.2, 0.0}, 0.76});
    scene->exposure_ev100 = 4.0;
    measure(*scene);
    return scene;
}

std::shared_ptr<const SceneAsset> make_stage(int side) {
    auto scene = std::make_shared<SceneAsset>();
    scene->name = "stage";
    add_piece(*scene, "floor", {0.35f, 0.26f, 0.18f}, flat({-6, 0, 4}, {6, 0, 4}, {6, 0, -4}, {-6, 0, -4}));
    add_piece(*scene, "back wall", {0.55f, 0.57f, 0.62f}, flat({-6, 0, -4}, {6, 0, -4}, {6, 7, -4}, {-6, 7, -4}));
    add_piece(*scene, "left wing", glm::vec3(0.15f), flat({-6, 0, 4}, {-6, 0, -4}, {-6, 7, -4}, {-6, 7, 4}));
    add_piece(*scene, "right wing", glm::vec3(0.15f), flat({6, 0, -4}, {6, 0, 4}, {6, 7, 4}, {6, 7, -4}));
    Mesh steps = box({-2, 0, -3.4}, {2, 0.4, -1.0}, kNoBottom);
    add_box(steps, {-1.6, 0.4, -3.4}, {1.6, 0.8, -1.8}, kNoBottom);
    add_piece(*scene, "steps", glm::vec3(0.6f), std::move(steps));
    const glm::dvec3 half_flat(0.8, 3.0, 0.05);
    const auto turned = [](double x, double z, double turn_deg) {
        return glm::rotate(at(x, 0, z), glm::radians(turn_deg), glm::dvec3(0, 1, 0));
    };
    add_piece(*scene, "red flat", {0.62f, 0.1f, 0.08f},
              box({-half_flat.x, 0, -half_flat.z}, {half_flat.x, half_flat.y, half_flat.z}, kNoBottom),
              turned(-4.0, -1.5, 35.0));
    add_piece(*scene, "blue flat", {0.1f, 0.2f, 0.6f},
              box({-half_flat.x, 0, -half_flat.z}, {half_flat.x, half_flat.y, half_flat.z}, kNoBottom),
              turned(4.0, -1.5, -35.0));
    add_piece(*scene, "left column", glm::vec3(0.7f), column(0.25, 4.0), at(-2.7, 0, -2.6));
    add_piece(*scene, "right column", glm::vec3(0.7f), column(0.25, 4.0), at(2.7, 0, -2.6));
    Mesh table = box({-0.8, 0.7, -0.45}, {0.8, 0.76, 0.45});
    for (const double tx : {-0.75, 0.69}) {
        for (const double tz : {-0.42, 0.36}) add_box(table, {tx, 0, tz}, {tx + 0.06, 0.7, tz + 0.06}, kNoBottom);
    }
    add_piece(*scene, "table", {0.5f, 0.36f, 0.2f}, std::move(table), turned(2.4, 1.0, 20.0));
    add_piece(*scene, "ball", {0.75f, 0.6f, 0.25f}, ball(0.55), at(-2.2, 0.55, 0.9));
    for (int j = 0; j < side; ++j) {
        for (int i = 0; i < side; ++i) {
            // Evenly over 9 × 5 m; the outer rows lean towards the middle of the stage.
            const double x = 9.0 * ((i + 0.5) / side - 0.5), z = 5.0 * ((j + 0.5) / side - 0.5);
            scene->lights.push_back(luminaire(std::to_string(j * side + i + 1), {x, 5.6, z + 0.4},
                                              {-0.6 * x, -5.6, -0.6 * z}, "downlight", 8.0 / (side * side)));
        }
    }
    scene->cameras.push_back({{0.6, 2.6, 11.5}, {0.0, 2.1, 0.0}, 0.68});
    scene->exposure_ev100 = 5.0;
    measure(*scene);
    return scene;
}

}  // namespace gonio::test
