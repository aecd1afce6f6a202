#include "tests/scenes/scenes.h"
#include "server/scene/scene.h"

#include <map>

namespace gonio::test {

std::shared_ptr<const Profile> profile_of(const std::string& name, double step_deg,
                                          const std::function<double(double, double)>& law) {
    auto profile = std::make_shared<Profile>();
    profile->name = name;
    ies::PhotometricWeb& web = profile->photometry.web;
    const int nv = static_cast<int>(std::lround(180.0 / step_deg)),
              nh = static_cast<int>(std::lround(360.0 / step_deg));
    for (int i = 0; i <= nv; ++i) web.v_rad.push_back(std::numbers::pi * i / nv);
    for (int i = 0; i <= nh; ++i) web.h_rad.push_back(2 * std::numbers::pi * i / nh);
    for (double h : web.h_rad) {
        for (double v : web.v_rad) web.candela.push_back(static_cast<float>(law(v, h)));
    }
    profile->peak_cd = ies::peak_intensity(web).in(cd);
    profile->flux_lm = ies::total_flux(web).in(lm);
    return profile;
}

std::shared_ptr<const Profile> isotropic(double candela) {
    return profile_of("isotropic", 45.0, [=](double, double) { return candela; });
}

std::shared_ptr<const Profile> cosine_power(double candela, double power) {
    return profile_of("cosine power", 1.0, [=](double v, double) {
        return v < std::numbers::pi / 2 ? candela * std::pow(std::cos(v), power) : 0.0;
    });
}

Mesh quad(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
    Mesh mesh;
    const glm::vec3 normal(glm::normalize(glm::cross(b - a, c - a)));
    for (const glm::dvec3& p : {a, b, c, d}) mesh.vertices.push_back({glm::vec3(p), normal, glm::vec2(0)});
    mesh.indices = {0, 1, 2, 0, 2, 3};
    return mesh;
}

Mesh inward_sphere(double radius_m, int rings) {
    Mesh mesh;
    const int segments = 2 * rings;
    for (int i = 0; i <= rings; ++i) {
        for (int j = 0; j <= segments; ++j) {
            const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * j / segments;
            const glm::dvec3 d(std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi));
            mesh.vertices.push_back({glm::vec3(d * radius_m), glm::vec3(-d), glm::vec2(0)});
        }
    }
    for (int i = 0; i < rings; ++i) {
        for (int j = 0; j < segments; ++j) {
            const auto a = static_cast<std::uint32_t>(i * (segments + 1) + j), b = a + 1,
                       c = a + static_cast<std::uint32_t>(segments) + 1, d = c + 1;
            for (std::uint32_t index : {a, b, c, b, d, c}) mesh.indices.push_back(index);
        }
    }
    return mesh;
}

Scene scene_with(std::vector<Piece> pieces, std::shared_ptr<const Profile> profile, const glm::dvec3& light_position,
                 const glm::dquat& orientation, const glm::dvec3& offset) {
    auto asset = std::make_shared<SceneAsset>();
    asset->name = "test";
    for (Piece& piece : pieces) {
        Material material;
        material.base_color = glm::vec4(piece.reflectance, 1.0f);
        material.emissive_nit = piece.emissive_nit;
        piece.mesh.material = static_cast<int>(asset->materials.size());
        asset->materials.push_back(material);
        for (const Vertex& vertex : piece.mesh.vertices) {
            piece.mesh.bounds.min = glm::min(piece.mesh.bounds.min, glm::dvec3(vertex.position));
            piece.mesh.bounds.max = glm::max(piece.mesh.bounds.max, glm::dvec3(vertex.position));
        }
        asset->bounds.min = glm::min(asset->bounds.min, piece.mesh.bounds.min + offset);
        asset->bounds.max = glm::max(asset->bounds.max, piece.mesh.bounds.max + offset);
        glm::dmat4 transform(1.0);
        transform[3] = glm::dvec4(offset, 1.0);
        asset->instances.push_back({static_cast<int>(asset->meshes.size()), transform, ""});
        asset->meshes.push_back(std::move(piece.mesh));
    }
    LightSeed light;
    light.name = "light";
    light.position = light_position + offset;
    light.world_from_light = orientation;
    light.profile = std::move(profile);
    asset->lights.push_back(light);
    Scene scene = scene_of(asset);
    scene.width_px = scene.height_px = 128;
    return scene;
}

Scene floor_scene(double side_m, float reflectance, std::shared_ptr<const Profile> profile,
                  const glm::dvec3& light_position, const glm::dquat& orientation) {
    const double s = side_m / 2;
    return scene_with({{quad({-s, 0, s}, {s, 0, s}, {s, 0, -s}, {-s, 0, -s}), glm::vec3(reflectance)}},
                      std::move(profile), light_position, orientation);
}

std::shared_ptr<const Profile> as_point(const std::shared_ptr<const Profile>& profile) {
    auto point = std::make_shared<Profile>(*profile);
    point->photometry.opening = {};
    return point;
}

std::shared_ptr<const SceneAsset> of_points(const SceneAsset& asset) {
    auto points = std::make_shared<SceneAsset>(asset);
    std::map<const Profile*, std::shared_ptr<const Profile>> made;
    for (LightSeed& light : points->lights) {
        std::shared_ptr<const Profile>& point = made[light.profile.get()];
        if (!point) point = as_point(light.profile);
        light.profile = point;
    }
    return points;
}

void repeat_light(Scene& scene, std::size_t count, const std::function<void(Light& light, std::size_t i)>& change) {
    const Light first = scene.lights.at(0);
    scene.lights.clear();
    for (std::size_t i = 0; i < count; ++i) {
        Light light = first;
        if (i > 0) {
            light.id = scene.next_light_id++;
            light.name += std::to_string(i);
        }
        change(light, i);
        scene.lights.push_back(std::move(light));
    }
}

}  // namespace gonio::test
