// Passes that rasterise meshes: G-buffer, shadow cube, reflective shadow map.
#include "server/render/passes/passes.h"
#include "server/render/passes/screen.h"
#include "server/scene/scene.h"
#include "shaders/lib/as_cpp.h"

namespace gonio {
namespace {

void begin_raster(GLuint framebuffer, int width_px, int height_px) {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, width_px, height_px);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GREATER);  // reversed depth
    glDisable(GL_BLEND);
}

}  // namespace

glm::mat4 clip_from_local(const Eye& eye, float near_m) {
    // A point's position in the whole view is (x/w, y/w); in the window, that minus its centre, over its half size.
    const glm::vec3 w(eye.forward);
    const glm::vec3 x((eye.right / eye.tan_half_x - eye.forward * eye.window_centre.x) / eye.window_half.x);
    const glm::vec3 y((eye.up / eye.tan_half_y - eye.forward * eye.window_centre.y) / eye.window_half.y);
    return glm::transpose(glm::mat4(glm::vec4(x, 0), glm::vec4(y, 0), glm::vec4(0, 0, 0, near_m), glm::vec4(w, 0)));
}

PassRun run_gbuffer(const PassContext& context) {
    const Target& target = context.target;
    begin_raster(target.gbuffer.id(), target.width_px, target.height_px);
    const float zero[4] = {0, 0, 0, 0};
    const GLuint none[4] = {};
    for (int i = 0; i < (target.emissive ? 3 : 2); ++i)
        glClearNamedFramebufferfv(target.gbuffer.id(), GL_COLOR, i, zero);
    if (target.detail)
        glClearNamedFramebufferfv(target.gbuffer.id(), GL_COLOR, (target.emissive ? 3 : 2) + (target.cell ? 1 : 0),
                                  zero);
    if (target.cell) glClearNamedFramebufferuiv(target.gbuffer.id(), GL_COLOR, target.emissive ? 3 : 2, none);
    glClearNamedFramebufferfv(target.gbuffer.id(), GL_DEPTH, 0, zero);
    const auto mode = target.cell ? GpuScene::Mode::gbuffer_cells : GpuScene::Mode::gbuffer;
    const glm::mat4 clip = clip_from_local(context.eye, context.geometry.near_m());
    PassRun run = context.geometry.draw(mode, context.programs, context.eye.position, clip, 1);
    if (context.bodies != nullptr)
        run.draws += context.bodies->gpu().draw(mode, context.programs, context.eye.position, clip, 1).draws;
    return run;
}

PassRun run_meter_gbuffer(const PassContext& context) {
    const float depth = context.geometry.near_m();  // near / 1 m
    const glm::vec2 normal = glsl::octahedral_encode(glm::vec3(-context.eye.forward));
    const glm::vec4 white(1.0f);
    glClearTexImage(context.target.depth.id(), 0, GL_DEPTH_COMPONENT, GL_FLOAT, &depth);
    glClearTexImage(context.target.normal.id(), 0, GL_RG, GL_FLOAT, &normal[0]);
    glClearTexImage(context.target.albedo.id(), 0, GL_RGBA, GL_FLOAT, &white[0]);
    return {};
}

PassRun run_shadow(const PassContext& context, const Light& light, LightGpu& gpu, unsigned faces) {
    if (make_shadow(gpu, context.scene.lights.size())) faces = gpu.reached;
    for (int face = 0; face < 6; ++face) {
        if ((faces >> face & 1u) != 0) clear_face(gpu.shadow.id(), gpu.shadow_size, face, GL_DEPTH_COMPONENT, GL_FLOAT);
    }
    begin_raster(gpu.shadow_fbo.id(), gpu.shadow_size, gpu.shadow_size);
    const PassRun run =
        context.geometry.draw(GpuScene::Mode::shadow, context.programs, light.position, glm::mat4(1), faces);
    note_faces(gpu.shadow_faces, faces, light.position_rev, context.scene.geometry_rev);
    return run;
}

PassRun run_rsm(const PassContext& context, const Light& light, LightGpu& gpu, unsigned faces) {
    make_rsm(gpu, context.scene.technique != Technique::standard);
    // Faces that are not rendered and hold another position's scene are emptied, so that nothing stale is shown.
    const unsigned kept = missing_faces(gpu.rsm_faces, 63u, light.position_rev, context.scene.geometry_rev) ^ 63u;
    for (int face = 0; face < 6; ++face) {
        if ((kept & ~faces) >> face & 1u) continue;
        clear_face(gpu.radial_depth.id(), gpu.rsm_size, face, GL_RED, GL_FLOAT);
        clear_face(gpu.normal.id(), gpu.rsm_size, face, GL_RG, GL_FLOAT);
        clear_face(gpu.albedo.id(), gpu.rsm_size, face, GL_RGBA, GL_FLOAT);
        clear_face(gpu.rsm_depth.id(), gpu.rsm_size, face, GL_DEPTH_COMPONENT, GL_FLOAT);
        if (gpu.rsm_with_position) clear_face(gpu.position.id(), gpu.rsm_size, face, GL_RGBA, GL_FLOAT);
    }
    begin_raster(gpu.rsm_fbo.id(), gpu.rsm_size, gpu.rsm_size);
    const auto mode = gpu.rsm_with_position ? GpuScene::Mode::rsm_seed : GpuScene::Mode::rsm;
    const PassRun run = context.geometry.draw(mode, context.programs, light.position, glm::mat4(1), faces);
    note_faces(gpu.rsm_faces, faces, light.position_rev, context.scene.geometry_rev);
    ++gpu.rsm_version;
    return run;
}

}  // namespace gonio
