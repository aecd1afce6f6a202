#include "server/assets/mesh_builder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/assets/assets.h"

namespace gonio {
namespace {

void grow(Bounds& bounds, const glm::dvec3& point) {
    bounds.min = glm::min(bounds.min, point);
    bounds.max = glm::max(bounds.max, point);
}

// Leaves out triangles without area, which poles of surfaces produce.
void add_triangle(Mesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const glm::dvec3 pa(mesh.vertices[a].position), pb(mesh.vertices[b].position), pc(mesh.vertices[c].position);
    if (glm::length(glm::cross(pb - pa, pc - pa)) < 1e-12) return;
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
}

}  // namespace

void add_quad(Mesh& mesh, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d,
              const glm::dvec2& uv_size) {
    const glm::vec3 normal(glm::normalize(glm::cross(b - a, d - a)));
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    const glm::vec2 size(uv_size);
    mesh.vertices.push_back({glm::vec3(a), normal, {0.0f, size.y}});
    mesh.vertices.push_back({glm::vec3(b), normal, {size.x, size.y}});
    mesh.vertices.push_back({glm::vec3(c), normal, {size.x, 0.0f}});
    mesh.vertices.push_back({glm::vec3(d), normal, {0.0f, 0.0f}});
    mesh.indices.insert(mesh.indices.end(), {first, first + 1, first + 2, first, first + 2, first + 3});
}

void add_box(Mesh& mesh, const glm::dvec3& min, const glm::dvec3& max, unsigned left_out, double uv_per_m) {
    const auto corner = [&](bool x, bool y, bool z) {
        return glm::dvec3(x ? max.x : min.x, y ? max.y : min.y, z ? max.z : min.z);
    };
    const glm::dvec3 size = (max - min) * uv_per_m;
    const auto face = [&](unsigned bit, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                          const glm::dvec3& d, const glm::dvec2& uv) {
        if (!(left_out & bit)) add_quad(mesh, a, b, c, d, uv);
    };
    face(kNoBottom, corner(0, 0, 0), corner(1, 0, 0), corner(1, 0, 1), corner(0, 0, 1), {size.x, size.z});
    face(kNoTop, corner(0, 1, 1), corner(1, 1, 1), corner(1, 1, 0), corner(0, 1, 0), {size.x, size.z});
    face(kNoLeft, corner(0, 0, 0), corner(0, 0, 1), corner(0, 1, 1), corner(0, 1, 0), {size.z, size.y});
    face(kNoRight, corner(1, 0, 1), corner(1, 0, 0), corner(1, 1, 0), corner(1, 1, 1), {size.z, size.y});
    face(kNoBack, corner(1, 0, 0), corner(0, 0, 0), corner(0, 1, 0), corner(1, 1, 0), {size.x, size.y});
    face(kNoFront, corner(0, 0, 1), corner(1, 0, 1), corner(1, 1, 1), corner(0, 1, 1), {size.x, size.y});
}

// The grid's four properties beside the mesh, the surface and the texture's size.
void add_surface(Mesh& mesh, const Surface& surface, int nu, int nv, bool closed_u, bool closed_v,
                 const glm::dvec2& uv_size) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    // Central differences over 2 h: error of the direction about h^2 = 1e-8. Open rims use the one-sided difference.
    constexpr double h = 1e-4;
    const auto derivative = [&](double u, double v, bool along_u) {
        const bool closed = along_u ? closed_u : closed_v;
        const double at = along_u ? u : v;
        double low = at - h, high = at + h;
        if (!closed) {
            low = std::max(low, 0.0);
            high = std::min(high, 1.0);
        }
        const auto wrapped = [&](double t) { return closed ? t - std::floor(t) : t; };
        return along_u ? surface(wrapped(high), v) - surface(wrapped(low), v)
                       : surface(u, wrapped(high)) - surface(u, wrapped(low));
    };
    for (int j = 0; j <= nv; ++j) {
        for (int i = 0; i <= nu; ++i) {
            const double u = static_cast<double>(i) / nu, v = static_cast<double>(j) / nv;
            // The seam's two vertex rows are evaluated at the same parameter, so the surface closes bit for bit.
            const double pu = closed_u && i == nu ? 0.0 : u, pv = closed_v && j == nv ? 0.0 : v;
            const glm::dvec3 point = surface(pu, pv);
            glm::dvec3 normal = glm::cross(derivative(pu, pv, true), derivative(pu, pv, false));
            if (glm::length(normal) < 1e-14) {  // a pole: take the normal a little inside
                const double iu = std::clamp(pu, 1e-3, 1.0 - 1e-3), iv = std::clamp(pv, 1e-3, 1.0 - 1e-3);
                normal = glm::cross(derivative(iu, iv, true), derivative(iu, iv, false));
            }
            mesh.vertices.push_back({glm::vec3(point),
                                     glm::vec3(glm::normalize(normal)),
                                     {static_cast<float>(u * uv_size.x), static_cast<float>((1.0 - v) * uv_size.y)}});
        }
    }
    const auto at = [&](int i, int j) { return first + static_cast<std::uint32_t>(j * (nu + 1) + i); };
    for (int j = 0; j < nv; ++j) {
        for (int i = 0; i < nu; ++i) {
            add_triangle(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1));
            add_triangle(mesh, at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
    }
}

void add_lathe(Mesh& mesh, const std::vector<glm::dvec2>& profile, int slices, const glm::dvec2& uv_size) {
    for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
        const glm::dvec2 low = profile[k], high = profile[k + 1];
        if (glm::length(high - low) < 1e-9) continue;
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        const glm::dvec2 outward = glm::normalize(glm::dvec2(high.y - low.y, low.x - high.x));
        for (int i = 0; i <= slices; ++i) {
            const double turn = static_cast<double>(i % slices) / slices * 2.0 * std::numbers::pi;
            const double c = std::cos(turn), s = std::sin(turn);
            const glm::vec3 normal(outward.x * c, outward.y, -outward.x * s);
            const auto u = static_cast<float>(uv_size.x * i / slices);
            for (const glm::dvec2& p : {low, high}) {
                mesh.vertices.push_back(
                    {glm::vec3(p.x * c, p.y, -p.x * s), normal, {u, static_cast<float>(-p.y * uv_size.y)}});
            }
        }
        for (int i = 0; i < slices; ++i) {
            const std::uint32_t a = first + 2 * static_cast<std::uint32_t>(i);
            add_triangle(mesh, a, a + 2, a + 3);
            add_triangle(mesh, a, a + 3, a + 1);
        }
    }
}

void measure(Mesh& mesh) {
    mesh.bounds = {};
    for (const Vertex& vertex : mesh.vertices) grow(mesh.bounds, glm::dvec3(vertex.position));
}

void measure(SceneAsset& scene) {
    if (scene.instances.empty()) return measure_lights(scene);
    scene.bounds = {};
    for (const Instance& instance : scene.instances) {
        for (const Vertex& vertex : scene.meshes[instance.mesh].vertices) {
            grow(scene.bounds, glm::dvec3(instance.world_from_mesh * glm::dvec4(vertex.position, 1.0)));
        }
    }
}

void measure_lights(SceneAsset& scene) {
    scene.bounds = {};
    for (const LightSeed& light : scene.lights)
        for (const double side : {-1.0, 1.0}) grow(scene.bounds, light.position + side);
    if (scene.lights.empty()) scene.bounds = {glm::dvec3(-1.0), glm::dvec3(1.0)};
}

int add_material(SceneAsset& scene, std::string name, const glm::vec3& reflectance, int image) {
    Material material;
    material.name = std::move(name);
    material.base_color = glm::vec4(reflectance, 1.0f);
    material.base_color_image = image;
    scene.materials.push_back(std::move(material));
    return static_cast<int>(scene.materials.size()) - 1;
}

int add_mesh(SceneAsset& scene, Mesh mesh, int material) {
    mesh.material = material;
    measure(mesh);
    scene.meshes.push_back(std::move(mesh));
    return static_cast<int>(scene.meshes.size()) - 1;
}

void add_instance(SceneAsset& scene, int mesh, std::string node, const glm::dmat4& world_from_mesh) {
    scene.instances.push_back({mesh, world_from_mesh, std::move(node)});
}

void add_luminaire(SceneAsset& scene, const glm::dvec3& position, double multiplier) {
    LightSeed& light = scene.lights.emplace_back();
    light.name = "luminaire";
    light.position = position;
    // Node frame: -Z aims at -Y and C0 stays on +X.
    light.world_from_light = glm::angleAxis(-std::numbers::pi / 2.0, glm::dvec3(1.0, 0.0, 0.0));
    light.multiplier = multiplier;
    if (auto profile = builtin_profile("batwing")) light.profile = *profile;
}

}  // namespace gonio
