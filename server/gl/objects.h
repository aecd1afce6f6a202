// Move-only owners of GL names. Direct state access and immutable storage only; every object carries a label for
// KHR_debug. All functions: render thread, with its context current.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <string_view>
#include <utility>
#include <vector>

namespace gonio::gl {

template <void (*Delete)(GLuint)>
class Handle {
public:
    Handle() = default;
    explicit Handle(GLuint id) : id_(id) {}
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(id_, other.id_);
        return *this;
    }
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle() {
        if (id_ != 0) Delete(id_);
    }
    explicit operator bool() const { return id_ != 0; }
    GLuint id() const { return id_; }

private:
    GLuint id_ = 0;
};

void delete_buffer(GLuint id);
void delete_texture(GLuint id);
void delete_framebuffer(GLuint id);
void delete_program(GLuint id);
void delete_query(GLuint id);
void delete_vertex_array(GLuint id);
void delete_sampler(GLuint id);

using Buffer = Handle<delete_buffer>;
using Texture = Handle<delete_texture>;
using Framebuffer = Handle<delete_framebuffer>;
using Program = Handle<delete_program>;
using Query = Handle<delete_query>;
using VertexArray = Handle<delete_vertex_array>;
using Sampler = Handle<delete_sampler>;

// A fence in the command stream; null when empty.
class Fence {
public:
    Fence() = default;
    static Fence insert();
    Fence(Fence&& other) noexcept : sync_(std::exchange(other.sync_, nullptr)) {}
    Fence& operator=(Fence&& other) noexcept {
        std::swap(sync_, other.sync_);
        return *this;
    }
    Fence(const Fence&) = delete;
    Fence& operator=(const Fence&) = delete;
    ~Fence();
    explicit operator bool() const { return sync_ != nullptr; }
    // Result: whether the GPU has passed the fence within timeout_ns.
    bool wait(GLuint64 timeout_ns) const;

private:
    GLsync sync_ = nullptr;
};

// data may be null. flags: as of glNamedBufferStorage.
Buffer make_buffer(std::string_view label, std::size_t bytes, const void* data, GLbitfield flags = 0);

enum class Filter { nearest, linear };
// Immutable textures, clamped to the edge. levels: mip levels, at least 1.
Texture make_texture_2d(std::string_view label, GLenum format, int width, int height, Filter filter, int levels = 1);
Texture make_texture_array(std::string_view label, GLenum format, int width, int height, int layers, Filter filter);
Texture make_texture_cube(std::string_view label, GLenum format, int size, Filter filter, int levels = 1);

// Attachments at level 0; a cube or array texture is attached with all its layers. depth may be 0.
Framebuffer make_framebuffer(std::string_view label, const std::vector<GLuint>& colors, GLuint depth);

int mip_levels(int size);

}  // namespace gonio::gl
