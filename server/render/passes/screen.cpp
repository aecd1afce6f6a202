#include "server/render/passes/screen.h"

namespace gonio {

void begin_screen(Programs& programs, GLuint framebuffer, GLuint program, int width_px, int height_px) {
    if (!programs.screen) {
        GLuint id = 0;
        glCreateVertexArrays(1, &id);
        programs.screen = gl::VertexArray(id);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, width_px, height_px);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    glBindVertexArray(programs.screen.id());
    glUseProgram(program);
}

void draw_screen(int instances) {
    glDrawArraysInstanced(GL_TRIANGLES, 0, 3, instances);
}

void bind_surface(GLuint program, const PassContext& context, const glm::dvec3& light_position) {
    const Eye& eye = context.eye;
    const glm::dvec3 x = eye.right * eye.tan_half_x, y = eye.up * eye.tan_half_y;
    const glm::vec4 right(glm::vec3(x * eye.window_half.x), 0.0f), up(glm::vec3(y * eye.window_half.y), 0.0f);
    // The window's centre is off the axis: the ray through it, still one metre deep along the axis.
    const glm::vec4 forward(glm::vec3(eye.forward + x * eye.window_centre.x + y * eye.window_centre.y),
                            context.geometry.near_m());
    const glm::vec3 from_eye(light_position - eye.position);
    glProgramUniform4fv(program, 8, 1, &right[0]);
    glProgramUniform4fv(program, 9, 1, &up[0]);
    glProgramUniform4fv(program, 10, 1, &forward[0]);
    glProgramUniform3fv(program, 11, 1, &from_eye[0]);
    glBindTextureUnit(8, context.target.depth.id());
    glBindTextureUnit(9, context.target.normal.id());
}

GLuint layer_framebuffer(const Target& target, GLuint array, int layer) {
    const GLuint id = target.layer.id();
    glNamedFramebufferTextureLayer(id, GL_COLOR_ATTACHMENT0, array, 0, layer);
    glNamedFramebufferDrawBuffer(id, GL_COLOR_ATTACHMENT0);
    return id;
}

void clear_face(GLuint cube, int size, int face, GLenum format, GLenum type) {
    glClearTexSubImage(cube, 0, 0, 0, face, size, size, 1, format, type, nullptr);
}

}  // namespace gonio
