#include "server/gl/objects.h"

#include <bit>
#include <stdexcept>
#include <string>
#include <vector>

namespace gonio::gl {

Fence insert_fence() {
    return Fence(glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0));
}

bool passed(const Fence& fence, GLuint64 timeout_ns) {
    const GLenum state = glClientWaitSync(fence.id(), GL_SYNC_FLUSH_COMMANDS_BIT, timeout_ns);
    return state != GL_TIMEOUT_EXPIRED;  // of a lost context nothing comes any more: GL_WAIT_FAILED
}

static void label_object(GLenum kind, GLuint id, std::string_view label) {
    glObjectLabel(kind, id, static_cast<GLsizei>(label.size()), label.data());
}

Buffer make_buffer(std::string_view label, std::size_t bytes, const void* data, GLbitfield flags) {
    GLuint id = 0;
    glCreateBuffers(1, &id);
    glNamedBufferStorage(id, static_cast<GLsizeiptr>(bytes), data, flags);
    label_object(GL_BUFFER, id, label);
    return Buffer(id);
}

static Texture make_texture(std::string_view label, GLenum target, Filter filter, int levels) {
    GLuint id = 0;
    glCreateTextures(target, 1, &id);
    const GLint own = filter == Filter::linear ? GL_LINEAR : GL_NEAREST;
    glTextureParameteri(id, GL_TEXTURE_MAG_FILTER, own);
    glTextureParameteri(id, GL_TEXTURE_MIN_FILTER, levels > 1 ? GL_LINEAR_MIPMAP_LINEAR : own);
    for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
        glTextureParameteri(id, axis, GL_CLAMP_TO_EDGE);
    label_object(GL_TEXTURE, id, label);
    return Texture(id);
}

Texture make_texture_2d(std::string_view label, GLenum format, int width, int height, Filter filter, int levels) {
    Texture texture = make_texture(label, GL_TEXTURE_2D, filter, levels);
    glTextureStorage2D(texture.id(), levels, format, width, height);
    return texture;
}

Texture make_texture_array(std::string_view label, GLenum format, int width, int height, int layers, Filter filter) {
    Texture texture = make_texture(label, GL_TEXTURE_2D_ARRAY, filter, 1);
    glTextureStorage3D(texture.id(), 1, format, width, height, layers);
    return texture;
}

Texture make_texture_cube(std::string_view label, GLenum format, int size, Filter filter, int levels) {
    Texture texture = make_texture(label, GL_TEXTURE_CUBE_MAP, filter, levels);
    glTextureStorage2D(texture.id(), levels, format, size, size);
    return texture;
}

Framebuffer make_framebuffer(std::string_view label, const std::vector<GLuint>& colors, GLuint depth) {
    GLuint id = 0;
    glCreateFramebuffers(1, &id);
    Framebuffer framebuffer(id);
    std::vector<GLenum> buffers;
    for (GLuint color : colors) {
        const GLenum attachment = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(buffers.size());
        glNamedFramebufferTexture(id, attachment, color, 0);
        buffers.push_back(attachment);
    }
    if (depth != 0) glNamedFramebufferTexture(id, GL_DEPTH_ATTACHMENT, depth, 0);
    glNamedFramebufferDrawBuffers(id, static_cast<GLsizei>(buffers.size()), buffers.data());
    label_object(GL_FRAMEBUFFER, id, label);
    const GLenum status = glCheckNamedFramebufferStatus(id, GL_DRAW_FRAMEBUFFER);
    if (status != GL_FRAMEBUFFER_COMPLETE) {
        throw std::runtime_error("the GL framebuffer '" + std::string(label) +
                                 "' is incomplete: " + std::to_string(status));
    }
    return framebuffer;
}

int mip_levels(int size) {
    return static_cast<int>(std::bit_width(static_cast<unsigned>(size)));
}

}  // namespace gonio::gl
