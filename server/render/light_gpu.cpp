#include "server/render/light_gpu.h"

#include "ies/solid.h"
#include "server/render/web_buffer.h"

namespace gonio {

std::shared_ptr<const WebGpu> upload_web(const Profile& profile) {
    const ies::PhotometricWeb& web = profile.photometry.web;
    auto gpu = std::make_shared<WebGpu>();
    gpu->words = pack_web(web);
    gpu->buffer = gl::make_buffer("web " + profile.name, gpu->words.size() * 4, gpu->words.data());
    gpu->peak_cd = static_cast<float>(profile.max_cd);
    gpu->beam_cos = beam_cosine(web);
    gpu->uniform = uniform_grid(web);
    gpu->mask_size = mask_face_size(web);
    const ies::SolidMesh solid = ies::photometric_solid(web, Angle::degrees(5.0));
    std::vector<float> vertices;
    for (std::size_t i = 0; i < solid.positions.size(); i += 3) {
        vertices.insert(vertices.end(), {solid.positions[i], solid.positions[i + 1], solid.positions[i + 2],
                                         solid.normals[i], solid.normals[i + 1], solid.normals[i + 2]});
    }
    if (!solid.triangles.empty()) {
        gpu->solid_vertices = gl::make_buffer("solid vertices", vertices.size() * 4, vertices.data());
        gpu->solid_indices = gl::make_buffer("solid indices", solid.triangles.size() * 4, solid.triangles.data());
        gpu->solid_index_count = static_cast<GLsizei>(solid.triangles.size());
    }
    return gpu;
}

void prepare_maps(LightGpu& light, std::size_t lights, bool with_position, int rsm_size) {
    using gl::Filter;
    const int shadow_size = lights > 16 ? kShadowSize / 2 : kShadowSize;
    if (light.shadow_size != shadow_size) {
        light.shadow_size = shadow_size;
        light.shadow = gl::make_texture_cube("shadow", GL_DEPTH_COMPONENT32F, shadow_size, Filter::linear);
        glTextureParameteri(light.shadow.id(), GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
        glTextureParameteri(light.shadow.id(), GL_TEXTURE_COMPARE_FUNC, GL_GEQUAL);
        light.shadow_fbo = gl::make_framebuffer("shadow", {}, light.shadow.id());
        light.shadow_faces = {};
    }
    if (light.rsm_size != rsm_size || (with_position && !light.rsm_with_position)) {
        light.rsm_size = rsm_size;
        light.rsm_with_position = with_position;
        light.radial_depth = gl::make_texture_cube("rsm radial depth", GL_R32F, rsm_size, Filter::nearest);
        light.normal = gl::make_texture_cube("rsm normal", GL_RG16_SNORM, rsm_size, Filter::nearest);
        light.albedo = gl::make_texture_cube("rsm albedo", GL_RGBA16F, rsm_size, Filter::nearest);
        light.rsm_depth = gl::make_texture_cube("rsm depth", GL_DEPTH_COMPONENT32F, rsm_size, Filter::nearest);
        if (with_position) {
            light.position = gl::make_texture_cube("rsm position", GL_RGBA32F, rsm_size, Filter::nearest);
            light.rsm_fbo = gl::make_framebuffer(
                "rsm", {light.radial_depth.id(), light.normal.id(), light.albedo.id(), light.position.id()},
                light.rsm_depth.id());
        } else {
            light.position = gl::Texture();
            light.rsm_fbo = gl::make_framebuffer("rsm", {light.radial_depth.id(), light.normal.id(), light.albedo.id()},
                                                 light.rsm_depth.id());
        }
        light.flux = gl::make_texture_cube("rsm flux", GL_RGBA32F, rsm_size, Filter::nearest);
        light.flux_fbo = gl::make_framebuffer("rsm flux", {light.flux.id()}, 0);
        light.rsm_faces = {};
    }
    if (light.mask_size != light.web->mask_size) {
        light.mask_size = light.web->mask_size;
        light.mask =
            gl::make_texture_cube("mask", GL_RGBA32F, light.mask_size, Filter::linear, gl::mip_levels(light.mask_size));
        light.mask_fbo = gl::make_framebuffer("mask", {light.mask.id()}, 0);
    }
}

float mask_lod(const LightGpu& light) {
    int lod = 0;
    while ((light.rsm_size << (lod + 1)) <= light.mask_size) ++lod;
    return static_cast<float>(lod);
}

unsigned missing_faces(const LightGpu::Faces& faces, unsigned reached, Revision position_rev, Revision geometry_rev) {
    const bool same = faces.position_rev == position_rev && faces.geometry_rev == geometry_rev;
    return reached & ~(same ? faces.made : 0u);
}

void note_faces(LightGpu::Faces& faces, unsigned made, Revision position_rev, Revision geometry_rev) {
    const bool same = faces.position_rev == position_rev && faces.geometry_rev == geometry_rev;
    faces = {position_rev, geometry_rev, (same ? faces.made : 0u) | made};
}

}  // namespace gonio
