// Move-only owners of GL names. Direct state access and immutable storage only; every object carries a label for
// KHR_debug. All functions: render thread, with its context current.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace gonio::gl {

// Delete: GL's function that deletes one name, or a number of them.
template <auto& Delete, typename Name = GLuint>
class Handle {
public:
    Handle() = default;
    explicit Handle(Name id) : id_(id) {}
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, Name{})) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(id_, other.id_);
        return *this;
    }
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle() {
        if (!*this) return;
        if constexpr (std::is_invocable_v<decltype(Delete), Name>)
            Delete(id_);
        else
            Delete(1, &id_);
    }
    explicit operator bool() const { return id_ != Name{}; }
    Name id() const { return id_; }

private:
    Name id_{};
};

using Buffer = Handle<glDeleteBuffers>;
using Texture = Handle<glDeleteTextures>;
using Framebuffer = Handle<glDeleteFramebuffers>;
using Program = Handle<glDeleteProgram>;
using Query = Handle<glDeleteQueries>;
using VertexArray = Handle<glDeleteVertexArrays>;
using Sampler = Handle<glDeleteSamplers>;
using Fence = Handle<glDeleteSync, GLsync>;

// A fence in the command stream.
Fence insert_fence();
// Result: whether the GPU has passed the fence within timeout_ns.
bool passed(const Fence& fence, GLuint64 timeout_ns);

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
