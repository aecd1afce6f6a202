// What one picture is made of: G-buffer, irradiance layers per light, display. The live picture, a capture and a meter
// are targets of different size and precision; all run the same passes.
#pragma once

#include <cstdint>

#include "server/gl/objects.h"
#include "server/scene/eye.h"
#include "server/scene/scene.h"

namespace gonio {

// live: gather on a grid of 4 pixels, NV12. still: gather at each pixel, interleaved: pictures to look at.
// precise: 32-bit float layers, the whole VPL list at each pixel: values to rely on.
enum class TargetKind : std::uint8_t { live, still, precise };

struct Target {
    std::uint32_t id = 0;
    int width_px = 0, height_px = 0;
    TargetKind kind = TargetKind::live;
    int grid_step = 4;  // pixels between the gather's grid points; live and still
    bool emissive = false;
    int layer_count = 0;

    gl::Texture depth;     // W×H DEPTH32F, near / distance along the view axis, 0: no surface
    gl::Texture normal;    // W×H RG16_SNORM, octahedral, world
    gl::Texture albedo;    // W×H RGBA16F, linear reflectance
    gl::Texture emission;  // W×H RGBA16F, cd/m²; only where the scene has emitters
    gl::Framebuffer gbuffer;
    gl::Texture direct;         // W×H×lights R16F (precise: R32F), lux per candela of the light's peak, 1/m²
    gl::Texture indirect;       // W×H×lights RGBA16F (precise: RGBA32F), rgb likewise
    gl::Framebuffer layer;      // re-attached to one layer at a time
    gl::Texture tiles;          // grid points in 4×4 tiles, RGBA16F, rgb likewise: the interleaved gather
    gl::Texture grid;           // W/step × H/step RGBA16F: tiles after their window filter
    gl::Texture grid_position;  // W/step × H/step RGBA32F: light-relative position of the grid points, m; a: 1 where
                                // there is a surface
    gl::Texture grid_normal;    // W/step × H/step RGBA16F: their normals, world
    gl::Framebuffer tiles_fbo, grid_fbo;
    gl::Texture display;          // W×H RGBA8, sRGB-encoded R'G'B'
    gl::Framebuffer display_fbo;  // display with the G-buffer's depth, for the solid overlay
    gl::Texture nv12;             // W × 3H/2 R8
    gl::Framebuffer nv12_fbo;
};

Target make_target(std::uint32_t id, TargetKind kind, int width_px, int height_px, std::size_t lights, bool emissive);
// Result: points of the gather's grid, and of one of its 4×4 tiles.
glm::ivec2 grid_size(const Target& target);
glm::ivec2 tile_size(const Target& target);

}  // namespace gonio
