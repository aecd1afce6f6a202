// The indirect light of the default technique: the CPU's passes between the G-buffer and the layers (server/indirect).
#include <cmath>

#include "server/render/passes/passes.h"
#include "server/render/passes/screen.h"

namespace gonio {

// The CPU's side of one target: what it reads of the G-buffer, and what it made of it per light.
struct ScreenLight {
    indirect::Surfaces surfaces;
    indirect::ScreenGrid grid;
    std::vector<indirect::Occlusion> occlusion;  // by layer
    std::vector<std::uint16_t> halves;           // scratch: what is uploaded
    std::vector<float> floats;
};

namespace {

// Figures per setting: docs/performance.md.
constexpr indirect::Quality kLive{4, true, 2, 256, 4, 16.0f};
constexpr indirect::Quality kStill{1, true, 2, 256, 8, 16.0f};
constexpr indirect::Quality kPrecise{1, false, 2, 1024, 16, 16.0f};

const indirect::Quality& quality_of(TargetKind kind) {
    return kind == TargetKind::live ? kLive : kind == TargetKind::still ? kStill : kPrecise;
}

indirect::LightView view_of(const PassContext& context, const Light& light, const LightGpu& gpu) {
    return {context.traced, *gpu.rays, gpu.vpls, light.position - context.traced.origin(),
            glm::dmat3(glm::mat3_cast(light.world_from_light))};
}

}  // namespace

PassRun run_grid(const PassContext& context) {
    const Target& target = context.target;
    ScreenLight& screen = *target.screen;
    indirect::Surfaces& s = screen.surfaces;
    s.width = target.width_px;
    s.height = target.height_px;
    constexpr std::size_t kRow = 4 * indirect::kLanes;
    s.row_length = (static_cast<std::size_t>(s.width) + kRow - 1) / kRow * kRow;
    s.depth.resize(s.row_length * static_cast<std::size_t>(s.height));
    s.normal.resize(s.depth.size());
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glPixelStorei(GL_PACK_ROW_LENGTH, static_cast<GLint>(s.row_length));
    const auto bytes = static_cast<GLsizei>(s.depth.size() * 4);
    glGetTextureImage(target.depth.id(), 0, GL_DEPTH_COMPONENT, GL_FLOAT, bytes, s.depth.data());
    glGetTextureImage(target.normal.id(), 0, GL_RG, GL_SHORT, bytes, s.normal.data());
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);

    const Eye& eye = context.eye;
    const glm::dvec3 x = eye.right * eye.tan_half_x, y = eye.up * eye.tan_half_y;
    const glm::dvec3 right = x * (2.0 * eye.window_half.x / s.width), up = y * (2.0 * eye.window_half.y / s.height);
    s.rays.eye = context.traced.local(eye.position);
    s.rays.right = glm::vec3(right);
    s.rays.up = glm::vec3(up);
    s.rays.corner = glm::vec3(eye.forward + x * (eye.window_centre.x - eye.window_half.x) +
                              y * (eye.window_centre.y - eye.window_half.y) + 0.5 * (right + up));
    s.rays.near_m = context.geometry.near_m();
    s.depth_per_pixel = static_cast<float>(glm::length(up));
    screen.grid = indirect::make_grid(s, quality_of(target.kind));
    return {};
}

PassRun run_vpl(const PassContext& context, const Light& light, LightGpu& gpu) {
    gpu.vpls = indirect::cast(*gpu.rays, context.traced, light.position - context.traced.origin(),
                              glm::dmat3(glm::mat3_cast(light.world_from_light)), context.pool);
    return {};
}

PassRun run_occlusion(const PassContext& context, const Light& light, const LightGpu& gpu, int layer) {
    ScreenLight& screen = *context.target.screen;
    screen.occlusion.resize(std::max(screen.occlusion.size(), static_cast<std::size_t>(layer) + 1));
    screen.occlusion[static_cast<std::size_t>(layer)] =
        indirect::trace_occlusion(screen.grid, view_of(context, light, gpu), context.pool);
    return {};
}

PassRun run_gather(const PassContext& context, const Light& light, const LightGpu& gpu, int layer) {
    const Target& target = context.target;
    ScreenLight& screen = *target.screen;
    const indirect::Surfaces& s = screen.surfaces;
    const indirect::Planes planes = indirect::gather_grid(
        screen.grid, view_of(context, light, gpu), screen.occlusion[static_cast<std::size_t>(layer)], context.pool);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    if (screen.grid.quality.step > 1) {
        indirect::upsample(s, screen.grid, planes, screen.halves, context.pool);
        glPixelStorei(GL_UNPACK_ROW_LENGTH, static_cast<GLint>(s.row_length));
        glTextureSubImage3D(target.indirect.id(), 0, 0, 0, layer, s.width, s.height, 1, GL_RGBA, GL_HALF_FLOAT,
                            screen.halves.data());
        glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
        return {};
    }
    screen.floats.resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height) * 4);
    context.pool.run(s.height, [&](int row) {
        float* to = screen.floats.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(s.width) * 4;
        for (int x = 0; x < s.width; ++x, to += 4) {
            const auto at = static_cast<std::size_t>(screen.grid.grid.at(x, row));
            for (std::size_t k = 0; k < 3; ++k) to[k] = planes[k][at];
            to[3] = 1.0f;
        }
    });
    glTextureSubImage3D(target.indirect.id(), 0, 0, 0, layer, s.width, s.height, 1, GL_RGBA, GL_FLOAT,
                        screen.floats.data());
    return {};
}

PassRun run_gather_point(const PassContext& context, const Light& light, const LightGpu& gpu, int layer) {
    const Eye& eye = context.eye;
    const glm::vec4 value(
        glm::vec3(indirect::at_point(view_of(context, light, gpu), eye.position + eye.forward - context.traced.origin(),
                                     -eye.forward)),
        1.0f);
    glTextureSubImage3D(context.target.indirect.id(), 0, 0, 0, layer, 1, 1, 1, GL_RGBA, GL_FLOAT, &value[0]);
    return {};
}

std::shared_ptr<ScreenLight> make_screen_light() {
    return std::make_shared<ScreenLight>();
}

}  // namespace gonio
