// Meshes for the primitive types of GDTF's models (DIN SPEC 15800, PrimitiveType). The standard's own are more finely
// made; these have their extent and their origin, so that a model's Length, Width and Height scale them alike.
#include <array>
#include <cmath>
#include <numbers>

#include "server/assets/mesh_builder.h"
#include "server/exchange/import_parts.h"

namespace gonio::exchange {
namespace {

// A box, or a cylinder about Z, of GDTF's axes: Z up.
struct Solid {
    std::string_view primitive;
    glm::dvec3 least, most;
    bool round = false;
};
constexpr auto kSolids = std::to_array<Solid>({
    {"Cube", {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}},
    {"Cylinder", {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}, true},
    {"Base", {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}},
    {"Base1_1", {-0.5, -0.5, -1.0}, {0.5, 0.5, 0.0}},
    {"Yoke", {-0.5, -0.5, 0.33}, {0.5, 0.5, 0.5}},
    {"Yoke", {-0.5, -0.5, -0.5}, {-0.36, 0.5, 0.33}},
    {"Yoke", {0.36, -0.5, -0.5}, {0.5, 0.5, 0.33}},
    {"Head", {-0.5, -0.5, -0.2}, {0.5, 0.5, 0.25}, true},
    {"Head", {-0.3, -0.3, -0.5}, {0.3, 0.3, -0.2}, true},
    {"Head", {-0.35, -0.35, 0.25}, {0.35, 0.35, 0.5}, true},
    {"Scanner", {-0.5, -0.37, -0.5}, {0.5, 0.29, 0.5}},
    {"Scanner", {-0.15, -0.41, -0.1}, {0.15, -0.37, 0.07}},
    {"Scanner", {-0.15, -0.71, -0.25}, {0.15, -0.41, 0.2}},
    {"Scanner1_1", {-0.2, -0.37, -0.43}, {0.2, 0.37, -0.05}},
    {"Scanner1_1", {-0.22, -0.03, -0.3}, {0.22, 0.04, 0.0}},
    {"Scanner1_1", {-0.1, -0.73, -0.4}, {0.1, -0.37, -0.1}},
    {"Conventional", {-0.33, -0.33, -0.48}, {0.33, 0.33, 0.43}, true},
    {"Conventional", {-0.46, -0.53, -0.5}, {0.46, 0.53, -0.48}},
    {"Conventional", {-0.5, -0.96, -0.03}, {-0.46, 0.09, 0.05}},
    {"Conventional", {0.46, -0.96, -0.03}, {0.5, 0.09, 0.05}},
    {"Conventional", {-0.5, -1.07, -0.03}, {0.5, -0.96, 0.53}},
    {"Conventional1_1", {-0.33, -0.33, -1.66}, {0.33, 0.33, -0.3}, true},
    {"Conventional1_1", {-0.46, -0.5, -1.68}, {0.46, 0.5, -1.66}},
    {"Conventional1_1", {-0.5, -0.09, -1.0}, {-0.46, 0.09, -0.06}},
    {"Conventional1_1", {0.46, -0.09, -1.0}, {0.5, 0.09, -0.06}},
    {"Conventional1_1", {-0.5, -0.09, -0.06}, {0.5, 0.09, 0.0}},
});

glm::dvec3 on_sphere(double u, double v) {
    const double around = 2.0 * std::numbers::pi * u, up = std::numbers::pi * (v - 0.5);
    return 0.5 * glm::dvec3(std::cos(up) * std::sin(around), std::sin(up), std::cos(up) * std::cos(around));
}

}  // namespace

std::optional<Mesh> primitive_mesh(std::string_view primitive) {
    Mesh mesh;
    if (primitive == "Sphere") add_surface(mesh, on_sphere, 32, 16, true, false);
    for (const auto& [name, least, most, round] : kSolids) {
        if (name != primitive) continue;
        if (round)
            add_lathe(mesh, {{0.0, least.z}, {most.x, least.z}, {most.x, most.z}, {0.0, most.z}}, 32);
        else
            add_box(mesh, {least.x, least.z, -most.y}, {most.x, most.z, -least.y});
    }
    if (mesh.indices.empty()) return std::nullopt;
    return mesh;
}

}  // namespace gonio::exchange
