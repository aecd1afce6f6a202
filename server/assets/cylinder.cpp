// The built-in scene "cylinder": the inside of a closed cylinder, a world at 1 : 1000, lit by six flat strips that lie
// flush on its wall. All light stays inside, so that means over its area are known (docs/lightmaps.md).
#include <array>
#include <cmath>
#include <numbers>

#include "server/assets/assets.h"
#include "server/assets/mesh_builder.h"
#include "server/scene/orientation.h"

namespace gonio {
namespace {

constexpr double kCylinderRadius = 8.0, kHalf = 20.0;                                    // m; the axis is Z
constexpr double kStripWidth = 0.1;                                                      // m
constexpr double kLuminance = 10'000.0;                                                  // cd/m², of every strip
constexpr float kReflectance = 0.15f;                                                    // of all surfaces
constexpr std::array<std::array<double, 2>, 2> kStrips{{{-15.4, -4.6}, {4.35, 15.65}}};  // from and to, m along Z
constexpr double kWebStep_rad = std::numbers::pi / 360.0;

// A flat strip of one luminance: I0 cos.
std::shared_ptr<const Profile> strip(const std::string& name, double length_m) {
    auto profile = std::make_shared<Profile>();
    profile->name = name;
    const double candela = kLuminance * kStripWidth * length_m;
    ies::PhotometricWeb& web = profile->photometry.web;
    web.h_rad = {0.0, 2.0 * std::numbers::pi};
    const int steps = static_cast<int>(std::lround(0.5 * std::numbers::pi / kWebStep_rad));
    for (int i = 0; i <= steps; ++i) web.v_rad.push_back(i * kWebStep_rad);
    for (int plane = 0; plane < 2; ++plane) {
        for (int i = 0; i <= steps; ++i)
            web.candela.push_back(i == steps ? 0.0f : static_cast<float>(candela * std::cos(i * kWebStep_rad)));
    }
    profile->photometry.opening = {ies::OpeningShape::rectangle, kStripWidth * m, length_m * m, 0.0 * m};
    profile->peak_cd = ies::peak_intensity(web).in(cd);
    profile->flux_lm = ies::total_flux(web).in(lm);
    return profile;
}

}  // namespace

std::shared_ptr<const SceneAsset> make_cylinder(int facets) {
    auto scene = std::make_shared<SceneAsset>();
    scene->name = "cylinder";
    const int grey = add_material(*scene, "grey", glm::vec3(kReflectance));
    const double step = 2.0 * std::numbers::pi / facets;
    // A facet's middle lies at azimuth 0, where a strip is.
    const auto rim = [&](int i, double z) {
        const double azimuth = step * (i + 0.5);
        return glm::dvec3(kCylinderRadius * std::cos(azimuth), kCylinderRadius * std::sin(azimuth), z);
    };
    Mesh wall;
    for (int i = 0; i <= facets; ++i) {
        for (const double z : {-kHalf, kHalf}) {
            const glm::dvec3 p = rim(i % facets, z);
            wall.vertices.push_back({glm::vec3(p),
                                     glm::vec3(-p.x / kCylinderRadius, -p.y / kCylinderRadius, 0.0),
                                     {static_cast<float>(i) / static_cast<float>(facets), z > 0.0 ? 0.0f : 1.0f}});
        }
    }
    for (int i = 0; i < facets; ++i) {
        const auto a = static_cast<std::uint32_t>(2 * i);
        wall.indices.insert(wall.indices.end(), {a, a + 1, a + 3, a, a + 3, a + 2});
    }
    add_instance(*scene, add_mesh(*scene, std::move(wall), grey), "wall");
    for (const double end : {-1.0, 1.0}) {
        Mesh cap;
        cap.vertices.push_back(
            {{0.0f, 0.0f, static_cast<float>(end * kHalf)}, {0.0f, 0.0f, static_cast<float>(-end)}, {0.5f, 0.5f}});
        for (int i = 0; i < facets; ++i) {
            const glm::dvec3 p = rim(i, end * kHalf);
            cap.vertices.push_back({glm::vec3(p),
                                    {0.0f, 0.0f, static_cast<float>(-end)},
                                    glm::vec2(0.5 + 0.5 * p.x / kCylinderRadius, 0.5 + 0.5 * p.y / kCylinderRadius)});
        }
        for (int i = 0; i < facets; ++i) {
            const auto a = static_cast<std::uint32_t>(1 + i), b = static_cast<std::uint32_t>(1 + (i + 1) % facets);
            cap.indices.insert(cap.indices.end(), {0u, end < 0.0 ? a : b, end < 0.0 ? b : a});
        }
        add_instance(*scene, add_mesh(*scene, std::move(cap), grey), end < 0.0 ? "south cap" : "north cap");
    }
    const double apothem = kCylinderRadius * std::cos(0.5 * step);
    for (std::size_t plain = 0; plain < kStrips.size(); ++plain) {
        const auto [from, to] = kStrips[plain];
        const auto profile = strip(plain == 0 ? "south strip" : "north strip", to - from);
        for (int i = 0; i < 3; ++i) {
            const double azimuth = 2.0 * std::numbers::pi * i / 3.0;
            const glm::dvec3 out(std::cos(azimuth), std::sin(azimuth), 0.0);
            LightSeed& light = scene->lights.emplace_back();
            light.name = std::string(plain == 0 ? "south " : "north ") + std::to_string(120 * i);
            light.position = apothem * out + glm::dvec3(0.0, 0.0, 0.5 * (from + to));
            // Node frame: -Z aims at the axis of the world, C0 runs along it.
            const glm::dvec3 along(0.0, 0.0, 1.0);
            light.world_from_light = glm::normalize(glm::quat_cast(glm::dmat3(along, glm::cross(out, along), out)));
            light.profile = profile;
        }
    }
    scene->cameras.push_back({{0.0, 0.0, 18.0}, {0.0, 0.0, 0.0}, 1.2});
    scene->exposure_ev100 = 4.0;
    measure(*scene);
    return scene;
}

}  // namespace gonio
