// What one picture is made of: G-buffer, irradiance layers per light, display. The live picture, a capture and a meter
// are targets of different size and precision; all run the same passes.
#pragma once

#include <array>
#include <cstdint>

#include "server/gl/objects.h"
#include "server/scene/eye.h"

namespace gonio {

// A live target: indirect light on a grid of 4 pixels, NV12. A still one: the same once it rests: pictures to look at.
// A precise one: 32-bit float layers, links of its own at each pixel: values to rely on.
enum class TargetKind : std::uint8_t { live, still, precise };

struct Target {
    std::uint32_t id = 0;
    int width_px = 0, height_px = 0;
    TargetKind kind = TargetKind::live;
    bool emissive = false;
    int layer_count = 0;

    gl::Texture depth;     // W×H DEPTH32F, near / distance along the view axis, 0: no surface
    gl::Texture normal;    // W×H RG16_SNORM, octahedral, world
    gl::Texture albedo;    // W×H RGBA16F, linear reflectance
    gl::Texture emission;  // W×H RGBA32F, cd/m², the sun included; only where the scene has emitters
    gl::Texture detail;    // as normal, normal maps included; only where the scene has some
    gl::Texture cell;      // W×H RG32UI, shaders/lib/cell.glsl, 0: no surface; only where shaders gather
    gl::Framebuffer gbuffer;
    gl::Texture weights;  // W×H RGBA32UI and W×H R16UI, shaders/passes/gather_weights.frag; likewise
    gl::Texture surfel;
    gl::Framebuffer weights_fbo;
    gl::Texture direct;     // W×H×layers R16F (precise: R32F), lux per candela of the light's peak × layer_unit_m2
    gl::Texture indirect;   // W×H×layers RGBA16F (precise: RGBA32F), rgb likewise
    gl::Texture besides;    // W×H×2 RGBA16F (precise: RGBA32F), lux × ScreenLight::besides_unit_lx: light without a
                            // layer, direct and after bounces
    gl::Framebuffer layer;  // re-attached to one layer at a time
    gl::Texture display;    // W×H RGBA8, sRGB-encoded R'G'B'
    gl::Framebuffer display_fbo;  // display with the G-buffer's depth, for the solid overlay
    gl::Texture nv12;             // W × 3H/2 R8
    gl::Framebuffer nv12_fbo;
};

// Irradiance at one point per candela of peak, rgb: the mean of independent parts.
inline constexpr std::size_t kMeterParts = 16;
inline constexpr unsigned kMeterLinks = 8192;  // rays, all in all
struct PointLight {
    glm::dvec3 light{0.0};
    std::array<glm::dvec3, kMeterParts> parts{};
};
// gathers: shaders gather its indirect light. One call makes all of a target, so that it has eight parameters. Result:
// an empty target; its size is at least 1 × 1.
Target make_target(std::uint32_t id, TargetKind kind, int width_px, int height_px, std::size_t layers, bool emissive,
                   bool gathers = false, bool detailed = false);

}  // namespace gonio
