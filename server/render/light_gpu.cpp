#include "server/render/light_gpu.h"

#include "ies/solid.h"
#include "server/scene/light_tables.h"

namespace gonio {

std::shared_ptr<const WebGpu> make_web(std::shared_ptr<const Profile> profile) {
    auto web = std::make_shared<WebGpu>();
    auto tables = shared_tables_of(*profile);
    web->tables = tables.get();
    web->peak_cd = static_cast<float>(profile->peak_cd);
    web->profile = with_tables(std::move(profile), std::move(tables));
    return web;
}

GLuint web_buffer(const WebGpu& web) {
    const std::vector<std::uint32_t>& words = web.tables->words;
    if (web.buffer.id() == 0) web.buffer = gl::make_buffer("web " + web.profile->name, words.size() * 4, words.data());
    return web.buffer.id();
}

const SolidGpu& solid_of(const WebGpu& web) {
    if (web.solid) return *web.solid;
    SolidGpu& gpu = web.solid.emplace();
    const ies::SolidMesh solid = ies::photometric_solid(web.profile->photometry.web, Angle::degrees(5.0));
    if (solid.triangles.empty()) return gpu;
    std::vector<float> vertices;
    for (std::size_t i = 0; i < solid.positions.size(); i += 3) {
        vertices.insert(vertices.end(), {solid.positions[i], solid.positions[i + 1], solid.positions[i + 2],
                                         solid.normals[i], solid.normals[i + 1], solid.normals[i + 2]});
    }
    gpu.vertices = gl::make_buffer("solid vertices", vertices.size() * 4, vertices.data());
    gpu.indices = gl::make_buffer("solid indices", solid.triangles.size() * 4, solid.triangles.data());
    gpu.index_count = static_cast<GLsizei>(solid.triangles.size());
    return gpu;
}

int shadow_size_of(std::size_t lights) {
    return lights > 16 ? kShadowSize / 2 : kShadowSize;
}

bool make_shadow(LightGpu& light, std::size_t lights) {
    const int size = shadow_size_of(lights);
    if (light.shadow_size == size) return false;
    light.shadow_size = size;
    light.shadow = gl::make_texture_cube("shadow", GL_DEPTH_COMPONENT32F, size, gl::Filter::linear);
    glTextureParameteri(light.shadow.id(), GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTextureParameteri(light.shadow.id(), GL_TEXTURE_COMPARE_FUNC, GL_GEQUAL);
    light.shadow_fbo = gl::make_framebuffer("shadow", {}, light.shadow.id());
    light.shadow_faces = {};
    return true;
}

void make_rsm(LightGpu& light, bool with_position) {
    if (light.rsm_fbo.id() != 0 && (light.rsm_with_position || !with_position)) return;
    const auto cube = [&](const char* name, GLenum format) {
        return gl::make_texture_cube(name, format, light.rsm_size, gl::Filter::nearest);
    };
    light.rsm_with_position = with_position;
    light.radial_depth = cube("rsm radial depth", GL_R32F);
    light.normal = cube("rsm normal", GL_RG16_SNORM);
    light.albedo = cube("rsm albedo", GL_RGBA16F);
    light.rsm_depth = cube("rsm depth", GL_DEPTH_COMPONENT32F);
    light.flux = cube("rsm flux", GL_RGBA32F);
    std::vector<GLuint> colors = {light.radial_depth.id(), light.normal.id(), light.albedo.id()};
    if (with_position) {
        light.position = cube("rsm position", GL_RGBA32F);
        colors.push_back(light.position.id());
    }
    light.rsm_fbo = gl::make_framebuffer("rsm", colors, light.rsm_depth.id());
    light.flux_fbo = gl::make_framebuffer("rsm flux", {light.flux.id()}, 0);
    light.rsm_faces = {};
}

void make_mask(LightGpu& light) {
    if (light.mask_size == light.web->tables->mask_size) return;
    light.mask_size = light.web->tables->mask_size;
    light.mask =
        gl::make_texture_cube("mask", GL_RGBA32F, light.mask_size, gl::Filter::linear, gl::mip_levels(light.mask_size));
    light.mask_fbo = gl::make_framebuffer("mask", {light.mask.id()}, 0);
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
    faces = {position_rev, geometry_rev, (63u & ~missing_faces(faces, 63u, position_rev, geometry_rev)) | made};
}

}  // namespace gonio
