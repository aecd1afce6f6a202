#include "tests/scenes/placed.h"

#include "server/scene/scene.h"
#include "tests/scenes/scenes.h"

namespace gonio::test {

void renew(Scene& scene) {
    static Revision newest = 0;
    static std::uint32_t newest_light = 0;
    ++newest;
    scene.scene_rev = scene.geometry_rev = scene.camera_rev = scene.view_rev = scene.exposure_rev = scene.master_rev =
        scene.technique_rev = scene.size_rev = scene.lights_rev = scene.groups_rev = newest;
    for (Light& light : scene.lights) {
        light.id = ++newest_light;
        light.position_rev = light.aim_rev = light.profile_rev = light.level_rev = newest;
    }
}

LightSeed light_seed(std::shared_ptr<const Profile> profile, const glm::dvec3& position,
                     const glm::dquat& orientation) {
    LightSeed light;
    light.position = position;
    light.world_from_light = orientation;
    light.profile = std::move(profile);
    return light;
}

Material matte(double reflectance) {
    Material material;
    material.base_color = glm::vec4(glm::vec3(static_cast<float>(reflectance)), 1.0f);
    material.double_sided = true;
    return material;
}

Scene scene_of_pieces(std::vector<Placed> pieces, std::vector<LightSeed> lights, std::vector<Image> images) {
    auto asset = std::make_shared<SceneAsset>();
    asset->name = "stress";
    asset->images = std::move(images);
    for (Placed& piece : pieces) {
        const int index = static_cast<int>(asset->meshes.size());
        piece.mesh.material = index;
        piece.mesh.bounds = {};
        for (const Vertex& vertex : piece.mesh.vertices) {
            const glm::dvec3 p(vertex.position);
            piece.mesh.bounds.min = glm::min(piece.mesh.bounds.min, p);
            piece.mesh.bounds.max = glm::max(piece.mesh.bounds.max, p);
            const glm::dvec3 w(piece.world_from_mesh * glm::dvec4(p, 1.0));
            asset->bounds.min = glm::min(asset->bounds.min, w);
            asset->bounds.max = glm::max(asset->bounds.max, w);
        }
        asset->materials.push_back(piece.material);
        asset->instances.push_back({index, piece.world_from_mesh, ""});
        asset->meshes.push_back(std::move(piece.mesh));
    }
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (lights[i].name.empty()) lights[i].name = "light " + std::to_string(i);
        asset->lights.push_back(std::move(lights[i]));
    }
    Scene scene = gonio::scene_of(asset);
    scene.width_px = scene.height_px = 48;
    renew(scene);
    return scene;
}

std::vector<Placed> box(const glm::dvec3& min, const glm::dvec3& max, double reflectance, bool inwards) {
    const auto corner = [&](int bits) {
        return glm::dvec3(bits & 1 ? max.x : min.x, bits & 2 ? max.y : min.y, bits & 4 ? max.z : min.z);
    };
    // Corners by bits x + 2y + 4z, counter-clockwise from outside.
    constexpr int kFaces[6][4] = {{1, 3, 7, 5}, {0, 4, 6, 2}, {2, 6, 7, 3}, {0, 1, 5, 4}, {4, 5, 7, 6}, {0, 2, 3, 1}};
    std::vector<Placed> pieces;
    for (const auto& f : kFaces) {
        Placed piece;
        piece.mesh = inwards ? test::quad(corner(f[3]), corner(f[2]), corner(f[1]), corner(f[0]))
                             : test::quad(corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3]));
        piece.material = matte(reflectance);
        pieces.push_back(std::move(piece));
    }
    return pieces;
}

}  // namespace gonio::test
