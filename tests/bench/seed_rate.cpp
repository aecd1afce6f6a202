#include "tests/bench/seed_rate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace gonio::bench {
namespace {

constexpr unsigned kDirections = 4096;

constexpr const char* kVertex = R"(#version 450 core
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.5, 1.0);
})";

// Written on its own, not from the technique's shader: four fetches in one hashed rotation of a common set of
// directions, an octahedral decode, one geometry factor, a sum of three channels.
constexpr const char* kFragment = R"(#version 450 core
layout(std140, binding = 0) uniform Block { vec4 directions[4096]; };
layout(location = 0) uniform int sample_count;
layout(location = 1) uniform float mask_lod;
layout(binding = 0) uniform samplerCube positions;
layout(binding = 1) uniform samplerCube normals;
layout(binding = 2) uniform samplerCube fluxes;
layout(binding = 3) uniform samplerCube mask;
layout(location = 0) out vec4 result;

vec3 unfold(vec2 e) {
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float t = max(-n.z, 0.0);
    n.xy += vec2(n.x >= 0.0 ? -t : t, n.y >= 0.0 ? -t : t);
    return normalize(n);
}

void main() {
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    vec3 u;
    for (uint k = 0u; k < 3u; ++k) {
        uint h = ((k * 4099u + pixel.y) * 8191u + pixel.x) * 747796405u + 2891336453u;
        h = ((h >> ((h >> 28u) + 4u)) ^ h) * 277803737u;
        u[k] = float((h >> 22u ^ h) >> 8) / 16777216.0;
    }
    vec2 angle = 6.2831853 * u.yz;
    vec4 q = vec4(sqrt(1.0 - u.x) * vec2(sin(angle.x), cos(angle.x)), sqrt(u.x) * vec2(sin(angle.y), cos(angle.y)));
    mat3 turn = mat3(1.0 - 2.0 * (q.y * q.y + q.z * q.z), 2.0 * (q.x * q.y + q.z * q.w), 2.0 * (q.x * q.z - q.y * q.w),
                     2.0 * (q.x * q.y - q.z * q.w), 1.0 - 2.0 * (q.x * q.x + q.z * q.z), 2.0 * (q.y * q.z + q.x * q.w),
                     2.0 * (q.x * q.z + q.y * q.w), 2.0 * (q.y * q.z - q.x * q.w), 1.0 - 2.0 * (q.x * q.x + q.y * q.y));
    vec3 at = turn[0] * 0.3;
    vec3 facing = turn[1];
    vec3 sum = vec3(0.0);
    for (int k = 0; k < sample_count; ++k) {
        vec3 direction = turn * directions[k].xyz;
        vec3 p = textureLod(positions, direction, 0.0).xyz;
        vec3 n = unfold(textureLod(normals, direction, 0.0).rg);
        vec3 flux = textureLod(fluxes, direction, 0.0).rgb;
        float ratio = textureLod(mask, direction, mask_lod).g;
        vec3 d = at - p;
        float d2 = dot(d, d);
        sum += flux * (ratio * 12.566370614 * max(0.0, dot(n, d)) * max(0.0, -dot(facing, d)) / max(d2 * d2, 1e-36));
    }
    result = vec4(sum / (3.14159265358979 * float(sample_count)), 1.0);
})";

GLuint compiled(GLenum stage, const char* text) {
    const GLuint shader = glCreateShader(stage);
    glShaderSource(shader, 1, &text, nullptr);
    glCompileShader(shader);
    GLint ok = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (!ok) {
        char log[2048] = {};
        glGetShaderInfoLog(shader, sizeof log, nullptr, log);
        glDeleteShader(shader);
        throw std::runtime_error(std::string("the seed technique's rate shader does not compile: ") + log);
    }
    return shader;
}

void fill(const gl::Texture& cube, int level, int size, int channels, GLenum format, float low, float high,
          std::mt19937& random) {
    std::uniform_real_distribution<float> value(low, high);
    std::vector<float> texels(std::size_t{6} * static_cast<std::size_t>(size) * static_cast<std::size_t>(size) *
                              static_cast<std::size_t>(channels));
    for (float& x : texels) x = value(random);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage3D(cube.id(), level, 0, 0, 0, size, size, 6, format, GL_FLOAT, texels.data());
}

}  // namespace

SeedRate::SeedRate(int rsm_size, int mask_size) : program_(glCreateProgram()) {
    for (const auto& [stage, text] : {std::pair(GL_VERTEX_SHADER, kVertex), {GL_FRAGMENT_SHADER, kFragment}}) {
        const GLuint shader = compiled(stage, text);
        glAttachShader(program_.id(), shader);
        glDeleteShader(shader);
    }
    glLinkProgram(program_.id());
    GLint linked = 0;
    glGetProgramiv(program_.id(), GL_LINK_STATUS, &linked);
    if (!linked) throw std::runtime_error("the seed technique's rate shader does not link");

    using gl::Filter;
    std::mt19937 random(7);
    position_ = gl::make_texture_cube("rate position", GL_RGBA32F, rsm_size, Filter::nearest);
    fill(position_, 0, rsm_size, 4, GL_RGBA, -2.0f, 2.0f, random);
    normal_ = gl::make_texture_cube("rate normal", GL_RG16_SNORM, rsm_size, Filter::nearest);
    fill(normal_, 0, rsm_size, 2, GL_RG, -1.0f, 1.0f, random);
    flux_ = gl::make_texture_cube("rate flux", GL_RGBA16F, rsm_size, Filter::nearest);
    fill(flux_, 0, rsm_size, 4, GL_RGBA, 0.1f, 0.9f, random);
    mask_ = gl::make_texture_cube("rate mask", GL_RGBA32F, mask_size, Filter::linear, gl::mip_levels(mask_size));
    for (int level = 0; level < gl::mip_levels(mask_size); ++level)
        fill(mask_, level, mask_size >> level, 4, GL_RGBA, 0.0f, 1.0f, random);
    while ((rsm_size << (static_cast<int>(mask_lod_) + 1)) <= mask_size) mask_lod_ += 1.0f;
    GLuint id = 0;
    glCreateSamplers(1, &id);
    nearest_level_ = gl::Sampler(id);
    glSamplerParameteri(id, GL_TEXTURE_MIN_FILTER, GL_NEAREST_MIPMAP_NEAREST);
    glSamplerParameteri(id, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glCreateVertexArrays(1, &id);
    screen_ = gl::VertexArray(id);

    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    std::vector<float> directions;
    for (unsigned k = 0; k < kDirections; ++k) {
        const float z = 1.0f - 2.0f * uniform(random), phi = 2.0f * std::numbers::pi_v<float> * uniform(random);
        const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
        directions.insert(directions.end(), {r * std::cos(phi), r * std::sin(phi), z, 0.0f});
    }
    directions_ = gl::make_buffer("rate directions", directions.size() * sizeof(float), directions.data());
}

double SeedRate::ns_per_sample(int width_px, int height_px, unsigned samples) {
    const gl::Texture target = gl::make_texture_2d("rate target", GL_RGBA16F, width_px, height_px, gl::Filter::nearest);
    const gl::Framebuffer framebuffer = gl::make_framebuffer("rate target", {target.id()}, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
    glViewport(0, 0, width_px, height_px);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    glBindVertexArray(screen_.id());
    glUseProgram(program_.id());
    glProgramUniform1f(program_.id(), 1, mask_lod_);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, directions_.id());
    glBindTextureUnit(0, position_.id());
    glBindTextureUnit(1, normal_.id());
    glBindTextureUnit(2, flux_.id());
    glBindTextureUnit(3, mask_.id());
    glBindSampler(3, nearest_level_.id());
    const unsigned count = std::min(samples, kDirections);
    glProgramUniform1i(program_.id(), 0, static_cast<GLint>(count));
    const auto draw = [] {
        glDrawArrays(GL_TRIANGLES, 0, 3);
        glFinish();
    };
    if (!compiled_) draw();
    compiled_ = true;
    const auto begin = std::chrono::steady_clock::now();
    draw();
    const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - begin;
    glBindSampler(3, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return spent.count() / (static_cast<double>(width_px) * height_px * count);
}

}  // namespace gonio::bench
