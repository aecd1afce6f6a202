#include "tests/bench/scene_hash.h"

#include "server/scene/apply.h"
#include "server/scene/opening.h"
#include "server/scene/scene.h"

namespace gonio::bench {

void Hash::add(const Scene& scene) {
    add(scene.camera.eye);
    add(scene.camera.target);
    add(scene.camera.fov_rad);
    const SceneAsset& asset = *scene.asset;
    for (const Mesh& mesh : asset.meshes) {
        add(mesh.vertices);
        if (!mesh.colors.empty()) bytes(mesh.colors.data(), mesh.colors.size() * sizeof(glm::u16vec4));
        if (!mesh.tangents.empty()) bytes(mesh.tangents.data(), mesh.tangents.size() * sizeof(glm::vec4));
        add(mesh.indices);
        add(mesh.material);
    }
    for (const Material& m : asset.materials) {
        bytes(&m.base_color[0], sizeof m.base_color);
        bytes(&m.emissive_nit[0], sizeof m.emissive_nit);
        for (const int x : {m.base_color_image, m.emissive_image, static_cast<int>(m.wrap_s),
                            static_cast<int>(m.wrap_t), int{m.alpha_mask}, int{m.double_sided}})
            add(x);
        add(m.alpha_cutoff);
        if (m.transmissive()) add(m.transmission);
    }
    for (const Image& image : asset.images) {
        add(image.width_px);
        add(image.rgba);
    }
    for (const Instance& instance : asset.instances) {
        add(instance.mesh);
        bytes(&instance.world_from_mesh[0][0], sizeof instance.world_from_mesh);
    }
    if (scene.haze.extinction_per_m > 0.0)
        for (const double x : {scene.haze.extinction_per_m, scene.haze.albedo, scene.haze.g, scene.haze.layer_height_m})
            add(x);
    for (const Light& light : scene.lights) {
        const ies::PhotometricWeb& web = light.profile->photometry.web;
        if (const ies::Opening opening = opening_of(light); opening.shape != ies::OpeningShape::point) {
            add(static_cast<int>(opening.shape));
            for (const auto& side : {opening.length, opening.width, opening.height}) add(side.base());
        }
        add(web.goniometer);
        add(web.v_rad);
        add(web.h_rad);
        add(web.candela);
        add(light.position);
        for (const double x :
             {light.world_from_light.w, light.world_from_light.x, light.world_from_light.y, light.world_from_light.z})
            add(x);
        add(light_weight(scene, light));
    }
}

}  // namespace gonio::bench
