// Passes that turn light into a picture: composite, solid overlay, NV12.
#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

#include "server/render/passes/composite_defines.h"
#include "server/render/passes/passes.h"
#include "server/render/passes/screen.h"
#include "server/scene/false_color.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/scene/white_balance.h"
#include "shaders/shared/composite.h"

namespace gonio {
namespace {

void bind_edges(const PassContext& context, ScreenLight& screen) {
    const lighting::Edges& edges = screen.surfaces.edges;
    EdgesOnGpu& on_gpu = screen.edges_on_gpu;
    const std::uint64_t version = context.pass_cache.version({Slot::edges, context.target.id});
    const auto made = [](const char* name, const auto& list) {
        return gl::make_buffer(name, std::max<std::size_t>(list.size(), 1) * sizeof(list[0]),
                               list.empty() ? nullptr : list.data());
    };
    const Target& target = context.target;
    const auto texture = [&](const char* name, GLenum format, GLenum type, const auto& values) {
        gl::Texture image = gl::make_texture_2d(name, format, target.width_px, target.height_px, gl::Filter::nearest);
        glPixelStorei(GL_UNPACK_ALIGNMENT, 2);
        glPixelStorei(GL_UNPACK_ROW_LENGTH, static_cast<GLint>(screen.surfaces.gbuffer.row_length));
        glTextureSubImage2D(image.id(), 0, 0, 0, target.width_px, target.height_px, GL_RGBA, type, values.data());
        glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
        return image;
    };
    if (on_gpu.version != version || version == 0) {
        on_gpu = {version,
                  made("edge rows", edges.rows),
                  made("edge pixels", edges.pixels),
                  made("edge taps", edges.taps),
                  texture("edge albedo", GL_RGBA16F, GL_HALF_FLOAT, edges.albedo),
                  {}};
        if (target.emissive) on_gpu.emission = texture("edge emission", GL_RGBA32F, GL_FLOAT, edges.emission);
    }
    glBindTextureUnit(layouts::kUnitAlbedo, on_gpu.albedo.id());
    if (target.emissive) glBindTextureUnit(layouts::kUnitEmissive, on_gpu.emission.id());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, on_gpu.rows.id());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, on_gpu.pixels.id());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, on_gpu.taps.id());
}

// Result: the smallest texture that holds all openings. at: becomes its lower left in the picture.
gl::Texture openings_texture(std::span<const lighting::ShiningPixel> openings, glm::ivec2& at) {
    glm::ivec2 greatest(0);
    at = glm::ivec2(std::numeric_limits<int>::max());
    for (const lighting::ShiningPixel& pixel : openings) {
        at = glm::min(at, glm::ivec2(pixel.x, pixel.y));
        greatest = glm::max(greatest, glm::ivec2(pixel.x, pixel.y));
    }
    const glm::ivec2 size = greatest - at + 1;
    std::vector<glm::vec4> values(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y), glm::vec4(0.0f));
    for (const lighting::ShiningPixel& pixel : openings) {
        const glm::ivec2 in = glm::ivec2(pixel.x, pixel.y) - at;
        values[static_cast<std::size_t>(in.y) * static_cast<std::size_t>(size.x) + static_cast<std::size_t>(in.x)] =
            glm::vec4(pixel.nit, pixel.covered);
    }
    gl::Texture image = gl::make_texture_2d("openings", GL_RGBA32F, size.x, size.y, gl::Filter::nearest);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTextureSubImage2D(image.id(), 0, 0, 0, size.x, size.y, GL_RGBA, GL_FLOAT, values.data());
    return image;
}

}  // namespace

bool shows_work_light(const PassContext& context) {
    return context.target.kind != TargetKind::precise && needs_work_light(context.scene);
}

PassRun run_composite(const PassContext& context, View view, const LightGpu* shown,
                      std::span<const LightGpu* const> lights, ScreenLight& screen, GLuint raw) {
    using namespace layouts;
    const Target& target = context.target;
    const std::vector<lighting::ShiningPixel> openings = shown_openings(context, view, screen.light);
    const bool edges = shows_lit_surfaces(view) && shows_edges(context) && !screen.surfaces.edges.rows.empty();
    const lighting::AirPicture* air = air_picture(context, view, lights, screen.surfaces, screen.light, screen.air);
    const bool work_light = view == View::beauty && shows_work_light(context);
    const CompositeParts parts{view,
                               raw != 0,
                               target.emissive && !context.scene.emission_hidden,
                               !openings.empty(),
                               edges,
                               air != nullptr,
                               work_light,
                               context.scene.look};
    const GLuint program =
        context.programs.get("passes/screen.vert", "passes/composite.frag", composite_defines(parts));
    begin_screen(context.programs, raw != 0 ? raw : target.display_fbo.id(), program, target.width_px,
                 target.height_px);

    static_assert(GONIO_MAX_LAYERS == kMostLayers);
    std::vector<layouts::LightWeight> weights(GONIO_MAX_LAYERS);
    int layers = 0;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const glm::dvec3 weight =
            context.layer_weight(context.scene.lights[i]) * (peak_of(context, context.scene.lights[i], *lights[i]) /
                                                             static_cast<double>(context.geometry.layer_unit_m2()));
        if (context.layers[i] < 0) continue;
        weights[context.layers[i]].rgb = glm::vec4(glm::vec3(weight), 0.0f);
        layers = std::max(layers, context.layers[i] + 1);
    }
    const gl::Buffer block =
        gl::make_buffer("light weights", weights.size() * sizeof(layouts::LightWeight), weights.data());
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, block.id());
    gl::Buffer colors;
    if (is_false_color(view) && raw == 0) {
        const layouts::FalseColorBlock made =
            color_block(false_color_of(context.scene, view), shows_difference(context.scene, view));
        colors = gl::make_buffer("false colour", sizeof made, &made);
        glBindBufferBase(GL_UNIFORM_BUFFER, 1, colors.id());
    }
    glProgramUniform1i(program, kAtLightCount, layers);
    glProgramUniform1f(program, kAtEv100, static_cast<float>(context.scene.exposure_ev100));
    glProgramUniform1f(program, kAtGain, static_cast<float>(context.scene.view_gain));
    if (composite_looks(parts)) {
        const glm::mat3 white(white_balance(parts.look.white_k, parts.look.white_duv));
        glProgramUniformMatrix3fv(program, kAtWhite, 1, GL_FALSE, &white[0][0]);
    }
    glBindTextureUnit(kUnitDirect, target.direct.id());
    glBindTextureUnit(kUnitIndirect, target.indirect.id());
    glBindTextureUnit(kUnitAlbedo, target.albedo.id());
    if (target.emissive) glBindTextureUnit(kUnitEmissive, target.emission.id());
    glBindTextureUnit(kUnitBesides, target.besides.id());
    const float has = context.besides ? 1.0f : 0.0f;  // else of an earlier frame
    glProgramUniform2f(program, kAtBesidesUnit, has * screen.besides_unit_lx[0], has * screen.besides_unit_lx[1]);
    glProgramUniform1i(program, kAtIndirectInLayers, context.merged ? 0 : 1);
    glBindTextureUnit(kUnitDepth, target.depth.id());
    if (work_light) {
        bind_surface(program, context, context.eye.position);
        glProgramUniform1f(program, kAtWorkLight, static_cast<float>(kWorkLightShown));
    }
    if (edges) bind_edges(context, screen);
    if (air != nullptr) {
        gl::Texture& texture = screen.air.texture;
        texture = gl::make_texture_2d("haze", GL_RGBA16F, target.width_px, target.height_px, gl::Filter::nearest);
        glPixelStorei(GL_UNPACK_ALIGNMENT, 2);
        glPixelStorei(GL_UNPACK_ROW_LENGTH, static_cast<GLint>(screen.surfaces.gbuffer.row_length));
        glTextureSubImage2D(texture.id(), 0, 0, 0, target.width_px, target.height_px, GL_RGBA, GL_HALF_FLOAT,
                            air->halves.data());
        glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
        glBindTextureUnit(kUnitAir, texture.id());
        glProgramUniform1f(program, kAtAirUnit, air->unit);
    }
    gl::Texture seen;
    if (!openings.empty()) {
        glm::ivec2 at;
        seen = openings_texture(openings, at);
        glBindTextureUnit(kUnitOpenings, seen.id());
        glProgramUniform2i(program, kAtOpenings, at.x, at.y);
    }
    float scale = 1.0f;
    if (shown != nullptr) {
        const auto& bounds = context.geometry.asset().bounds;
        if (view == View::rsm_depth)
            scale = static_cast<float>(1.0 / std::max(glm::length(bounds.max - bounds.min), 1e-9));
        if (view == View::rsm_flux && !shown->texels.flux.empty()) {
            float brightest = 1e-30f;
            for (const glm::vec4& flux : shown->texels.flux) brightest = std::max({brightest, flux.r, flux.g, flux.b});
            scale = 1.0f / brightest;
        }
        const GLuint cube = view == View::mask         ? shown->mask.id()
                            : view == View::rsm_depth  ? shown->radial_depth.id()
                            : view == View::rsm_normal ? shown->normal.id()
                                                       : shown->flux.id();
        glBindTextureUnit(kUnitCube, cube);
    }
    glProgramUniform1f(program, kAtCubeScale, scale);
    draw_screen();
    return {0, 1};
}

PassRun run_solid(const PassContext& context, std::span<const LightGpu* const> lights) {
    gl::VertexArray& vertex_array = context.programs.solid;
    if (!vertex_array) {
        GLuint id = 0;
        glCreateVertexArrays(1, &id);
        vertex_array = gl::VertexArray(id);
        for (GLuint i = 0; i < 2; ++i) {
            glEnableVertexArrayAttrib(id, i);
            glVertexArrayAttribFormat(id, i, 3, GL_FLOAT, GL_FALSE, i * 12);
            glVertexArrayAttribBinding(id, i, 0);
        }
    }
    const Target& target = context.target;
    const GLuint program = context.programs.get("passes/solid.vert", "passes/solid.frag");
    glBindFramebuffer(GL_FRAMEBUFFER, target.display_fbo.id());
    glViewport(0, 0, target.width_px, target.height_px);
    glUseProgram(program);
    glBindVertexArray(vertex_array.id());
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_FALSE);
    glDisable(GL_CULL_FACE);
    glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    const glm::mat4 clip = clip_from_local(context.eye, context.geometry.near_m());
    const glm::vec3 color(0.35f, 0.75f, 1.0f);
    glProgramUniformMatrix4fv(program, 0, 1, GL_FALSE, &clip[0][0]);
    glProgramUniform3fv(program, 2, 1, &color[0]);
    const auto& bounds = context.geometry.asset().bounds;
    const double radius_m = 0.12 * glm::length(bounds.max - bounds.min);  // the peak candela is drawn this long
    PassRun run;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const WebGpu& web = *lights[i]->web;
        const SolidGpu& solid = solid_of(web);
        if (solid.index_count == 0 || web.peak_cd <= 0.0f) continue;
        const Light& light = context.scene.lights[i];
        if (light.sun) continue;  // it is nowhere
        const glm::dmat4 local = glm::translate(glm::dmat4(1), light.position - context.eye.position) *
                                 glm::mat4_cast(light.world_from_light) *
                                 glm::scale(glm::dmat4(1), glm::dvec3(radius_m / static_cast<double>(web.peak_cd)));
        const glm::mat4 local_from_solid(local);
        glProgramUniformMatrix4fv(program, 1, 1, GL_FALSE, &local_from_solid[0][0]);
        glVertexArrayVertexBuffer(vertex_array.id(), 0, solid.vertices.id(), 0, 24);
        glVertexArrayElementBuffer(vertex_array.id(), solid.indices.id());
        glDrawElements(GL_TRIANGLES, solid.index_count, GL_UNSIGNED_INT, nullptr);
        ++run.draws;
    }
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    glDepthMask(GL_TRUE);
    return run;
}

PassRun run_nv12(const PassContext& context, View view) {
    const Target& target = context.target;
    const GLuint program = context.programs.get("passes/screen.vert", "passes/nv12.frag");
    begin_screen(context.programs, target.nv12_fbo.id(), program, target.width_px, target.height_px / 2 * 3);
    glBindTextureUnit(0, target.display.id());
    glProgramUniform1i(program, 1, filters_edges(context, view) ? 1 : 0);
    draw_screen();
    return {0, 1};
}

}  // namespace gonio
