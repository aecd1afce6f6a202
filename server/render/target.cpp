#include "server/render/target.h"

#include <algorithm>
#include <cmath>

namespace gonio {

Target make_target(std::uint32_t id, TargetKind kind, int width_px, int height_px, std::size_t layers, bool emissive,
                   bool gathers, bool detailed) {
    using gl::Filter;
    Target t;
    t.id = id;
    t.width_px = width_px;
    t.height_px = height_px;
    t.kind = kind;
    const bool precise = kind == TargetKind::precise;
    t.emissive = emissive;
    t.layer_count = static_cast<int>(std::max<std::size_t>(layers, 1));
    t.depth = gl::make_texture_2d("depth", GL_DEPTH_COMPONENT32F, width_px, height_px, Filter::nearest);
    t.normal = gl::make_texture_2d("normal", GL_RG16_SNORM, width_px, height_px, Filter::nearest);
    t.albedo = gl::make_texture_2d("albedo", GL_RGBA16F, width_px, height_px, Filter::nearest);
    std::vector<GLuint> colors = {t.normal.id(), t.albedo.id()};
    if (emissive) {
        t.emission = gl::make_texture_2d("emission", GL_RGBA32F, width_px, height_px, Filter::nearest);
        colors.push_back(t.emission.id());
    }
    if (gathers) {
        t.cell = gl::make_texture_2d("cell", GL_RG32UI, width_px, height_px, Filter::nearest);
        colors.push_back(t.cell.id());
        t.weights = gl::make_texture_2d("weights", GL_RGBA32UI, width_px, height_px, Filter::nearest);
        t.surfel = gl::make_texture_2d("surfel", GL_R16UI, width_px, height_px, Filter::nearest);
        t.weights_fbo = gl::make_framebuffer("weights", {t.weights.id(), t.surfel.id()}, 0);
    }
    if (detailed) {
        t.detail = gl::make_texture_2d("detail", GL_RG16_SNORM, width_px, height_px, Filter::nearest);
        colors.push_back(t.detail.id());
    }
    t.gbuffer = gl::make_framebuffer("gbuffer", colors, t.depth.id());
    const auto array = [&](const char* name, GLenum format, int size) {
        return gl::make_texture_array(name, format, width_px, height_px, size, Filter::nearest);
    };
    t.direct = array("direct", precise ? GL_R32F : GL_R16F, t.layer_count);
    t.indirect = array("indirect", precise ? GL_RGBA32F : GL_RGBA16F, t.layer_count);
    t.besides = array("besides", precise ? GL_RGBA32F : GL_RGBA16F, 2);
    GLuint layer = 0;
    glCreateFramebuffers(1, &layer);
    t.layer = gl::Framebuffer(layer);
    t.display = gl::make_texture_2d("display", GL_RGBA8, width_px, height_px, Filter::nearest);
    t.display_fbo = gl::make_framebuffer("display", {t.display.id()}, t.depth.id());
    if (kind == TargetKind::live) {
        t.nv12 = gl::make_texture_2d("nv12", GL_R8, width_px, height_px / 2 * 3, Filter::nearest);
        t.nv12_fbo = gl::make_framebuffer("nv12", {t.nv12.id()}, 0);
    }
    return t;
}

}  // namespace gonio
