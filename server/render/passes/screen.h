// What full-screen passes share: one triangle, no depth, no blending.
#pragma once

#include "server/gl/objects.h"
#include "server/render/passes/passes.h"

namespace gonio {

// Binds framebuffer and program, sets the viewport and plain state.
void begin_screen(Programs& programs, GLuint framebuffer, GLuint program, int width_px, int height_px);
void draw_screen(int instances = 1);
// Sets the uniforms and textures of shaders/lib/surface.glsl.
void bind_surface(GLuint program, const PassContext& context, const glm::dvec3& light_position);
// Attaches one layer of the target's direct or indirect array to its layer framebuffer; result: the framebuffer.
GLuint layer_framebuffer(const Target& target, GLuint array, int layer);
// Clears one face of a cube map's level 0 to zero.
void clear_face(GLuint cube, int size, int face, GLenum format, GLenum type);

}  // namespace gonio
