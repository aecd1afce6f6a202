// Passes that light the pixels of a target by shaders: direct, the seed paper's gather.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "server/render/passes/passes.h"
#include "server/render/passes/screen.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// Directions of the seed technique, the same in every frame. sphere: uniform unit vectors; disk: (radius, cos, sin).
gl::Buffer seed_directions(bool disk) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    std::vector<glm::vec4> directions(GONIO_MAX_SEED_DIRECTIONS);
    for (glm::vec4& d : directions) {
        const float a = uniform(random), phi = 2.0f * std::numbers::pi_v<float> * uniform(random);
        const float z = 1.0f - 2.0f * a, r = std::sqrt(std::max(0.0f, 1.0f - z * z));
        d = disk ? glm::vec4(a, std::cos(phi), std::sin(phi), 0.0f)
                 : glm::vec4(r * std::cos(phi), r * std::sin(phi), z, 0.0f);
    }
    return gl::make_buffer("seed directions", directions.size() * sizeof(glm::vec4), directions.data());
}

// Begins to draw a luminaire's light into a layer of the array. Binds what the shader multiplies by, and where the
// layer's format ends.
void begin_layer(const PassContext& context, const Light& light, const gl::Texture& array, int layer, GLuint program) {
    const Target& target = context.target;
    begin_screen(context.programs, layer_framebuffer(target, array.id(), layer), program, target.width_px,
                 target.height_px);
    bind_surface(program, context, light.position);
    glProgramUniform1f(program, 4, context.geometry.layer_unit_m2());
    glProgramUniform1f(program, 5, context.target.kind == TargetKind::precise ? 3e38f : 65504.0f);
}

}  // namespace

PassRun run_direct(const PassContext& context, const Light& light, const LightGpu& gpu, int layer) {
    gl::Defines defines;
    if (gpu.web->tables->uniform) defines.emplace_back("UNIFORM_WEB", "1");
    if (context.target.detail) defines.emplace_back("DETAIL", "1");
    if (context.haze) defines.emplace_back("HAZE", "1");
    const GLuint program = context.programs.get("passes/screen.vert", "passes/direct.frag", defines);
    begin_layer(context, light, context.target.direct, layer, program);
    if (context.haze) {
        const lighting::Air air = lighting::air_of(context.haze);
        glProgramUniform3f(program, 6, air.extinction_per_m, air.per_height,
                           air.floor_m - context.traced.local(light.position).y);
    }
    const glm::mat3 turn = light_from_world(light);
    glProgramUniformMatrix3fv(program, 1, 1, GL_FALSE, &turn[0][0]);
    glProgramUniform1f(program, 2, context.geometry.near_m());
    glProgramUniform1f(program, 3, 2.0f / static_cast<float>(gpu.shadow_size));
    glBindTextureUnit(0, gpu.shadow.id());
    if (context.target.detail) glBindTextureUnit(1, context.target.detail.id());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, web_buffer(*gpu.web));
    draw_screen();
    return {0, 1};
}

PassRun run_gather_seed(const PassContext& context, const Light& light, const LightGpu& gpu, int layer) {
    const bool disk = context.scene.technique == Technique::seed_disk;
    gl::Buffer& directions = context.programs.seed_directions[disk ? 1 : 0];
    if (!directions) directions = seed_directions(disk);
    if (!context.programs.nearest_level) {
        GLuint sampler = 0;
        glCreateSamplers(1, &sampler);
        context.programs.nearest_level = gl::Sampler(sampler);
        glSamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, GL_NEAREST_MIPMAP_NEAREST);
        glSamplerParameteri(sampler, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    }
    gl::Defines defines;
    if (disk) defines.emplace_back("DISK", "1");
    const GLuint program = context.programs.get("passes/screen.vert", "passes/gather_seed.frag", defines);
    begin_layer(context, light, context.target.indirect, layer, program);
    glProgramUniform1i(program, 1, static_cast<GLint>(context.scene.samples));
    glProgramUniform1f(program, 2, mask_lod(gpu));
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, directions.id());
    glBindTextureUnit(0, gpu.position.id());
    glBindTextureUnit(1, gpu.normal.id());
    glBindTextureUnit(2, gpu.albedo.id());
    glBindTextureUnit(3, gpu.mask.id());
    glBindSampler(3, context.programs.nearest_level.id());
    draw_screen();
    glBindSampler(3, 0);
    return {0, 1};
}

}  // namespace gonio
