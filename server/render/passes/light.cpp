// Passes of one luminaire that no camera enters: IES light mask, flux of the reflective shadow map.
#include "server/render/passes/passes.h"
#include "server/render/passes/screen.h"

namespace gonio {

glm::mat3 light_from_world(const Light& light) {
    return glm::transpose(glm::mat3(glm::mat3_cast(light.world_from_light)));
}

PassRun run_mask(const PassContext& context, const Light& light, LightGpu& gpu) {
    make_mask(gpu);
    const int size = gpu.mask_size;
    // Small masks stand for coarse webs: more midpoints per texel there, one where texels are far finer than the web.
    gl::Defines defines = {{"CUBE", "1"}, {"SUB", size <= 128 ? "3" : size <= 256 ? "2" : "1"}};
    if (gpu.web->tables->uniform) defines.emplace_back("UNIFORM_WEB", "1");
    const GLuint program = context.programs.get("passes/screen.vert", "passes/mask.frag", defines);
    begin_screen(context.programs, gpu.mask_fbo.id(), program, size, size);
    const glm::mat3 turn = light_from_world(light);
    glProgramUniformMatrix3fv(program, 1, 1, GL_FALSE, &turn[0][0]);
    glProgramUniform1f(program, 2, gpu.web->peak_cd);
    glProgramUniform1i(program, 3, size);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, web_buffer(*gpu.web));
    PassRun run;
    for (int face = 0; face < 6; ++face) {
        if ((gpu.reached >> face & 1u) == 0) {
            clear_face(gpu.mask.id(), size, face, GL_RGBA, GL_FLOAT);
            continue;
        }
        glProgramUniform1i(program, 0, face);
        draw_screen();
        ++run.draws;
        ++run.faces;
    }
    glGenerateTextureMipmap(gpu.mask.id());
    return run;
}

PassRun run_flux(const PassContext& context, LightGpu& gpu) {
    const GLuint program = context.programs.get("passes/screen.vert", "passes/flux.frag", {{"CUBE", "1"}});
    begin_screen(context.programs, gpu.flux_fbo.id(), program, gpu.rsm_size, gpu.rsm_size);
    glProgramUniform1i(program, 0, 0);
    glProgramUniform1f(program, 1, mask_lod(gpu));
    glProgramUniform1i(program, 2, gpu.rsm_size);
    glBindTextureUnit(0, gpu.mask.id());
    glBindTextureUnit(1, gpu.radial_depth.id());
    glBindTextureUnit(2, gpu.normal.id());
    glBindTextureUnit(3, gpu.albedo.id());
    draw_screen(6);

    RsmTexels& texels = gpu.texels;
    const std::size_t count6 = std::size_t{6} * gpu.rsm_size * gpu.rsm_size;
    texels.size = gpu.rsm_size;
    texels.flux.resize(count6);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glGetTextureImage(gpu.flux.id(), 0, GL_RGBA, GL_FLOAT, count6 * sizeof(glm::vec4), texels.flux.data());
    if (gpu.texels_rsm_version != gpu.rsm_version) {
        gpu.texels_rsm_version = gpu.rsm_version;
        texels.radial_depth.resize(count6);
        texels.normal.resize(2 * count6);
        glGetTextureImage(gpu.radial_depth.id(), 0, GL_RED, GL_FLOAT, count6 * 4, texels.radial_depth.data());
        glGetTextureImage(gpu.normal.id(), 0, GL_RG, GL_SHORT, count6 * 4, texels.normal.data());
    }
    return {0, 1};
}

}  // namespace gonio
