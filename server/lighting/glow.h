// Light of surfaces in the air: at points in space, from the surfels that they see, and along rays what haze scatters
// of it.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/lighting/airlight.h"
#include "server/transport/transport.h"

namespace gonio::lighting {

// Points in a box around the scene and the surfels that they see: kProbeLinks directions each, evenly over the sphere.
struct Probes {
    glm::ivec3 count{0};               // along each axis; 0: there are none
    glm::vec3 least{0.0f};             // the first, local, m
    glm::vec3 per_step{0.0f};          // 1 / distance of neighbours, 1/m
    std::vector<std::uint16_t> ids;    // kProbeLinks a probe; Surfels::count: nothing is met
    std::vector<float> directions[3];  // of the links, the same for all probes
    std::vector<glm::vec3> emission;   // of what the links lead to, cd/m²; empty: nothing emits
    std::size_t size() const { return static_cast<std::size_t>(count.x * count.y * count.z); }
};
inline constexpr int kMostProbes = 4096, kProbeLinks = 64;
// Result: the box that they fill, local, m. It is the scene's, and towards an eye outside as many of its radii longer
// as reach the eye, at most kMostOutside. Light that leaves a room is seen in the haze before it.
struct AirBox {
    glm::vec3 low{0.0f}, high{0.0f};
};
inline constexpr int kMostOutside = 8;
AirBox air_box(const trace::Geometry& geometry, const glm::vec3& eye);
Probes make_probes(const transport::Transport::Surface& surface, const AirBox& box, Pool& pool);

// By probe, what of the light there the phase function sends to an eye, over what it would send of the same light from
// everywhere: radiance, rgb.
using Glow = std::vector<glm::vec3>;
// glow: in the unit of `sent`. All rays that an eye sends through a probe come from one direction, about. sent: by the
// surfels, pi × radiance. emission: that of the probes counts too.
void glow_of(const Probes& probes, std::span<const glm::vec4> sent, bool emission, const glm::vec3& eye, float g,
             Glow& glow, Pool& pool);

// By probe, whether an eye sees it (1): backs of single-sided surfaces hide nothing. Light on its way to the eye passes
// through air that the eye sees. What is behind a wall is no part of it, and inside a housing it may be very bright.
std::vector<std::uint8_t> seen_probes(const Probes& probes, const trace::Geometry& geometry, const glm::vec3& eye,
                                      Pool& pool);
// Gives probes that the eye does not see the mean of those around that it does; where it sees none they keep their own.
void hide_unseen(const Probes& probes, std::span<const std::uint8_t> seen, Glow& glow);

// The same as RGB9_E5, × unit: to 0.2 % of a probe's greatest channel.
struct PackedGlow {
    std::vector<std::uint32_t> words;
    float unit = 1.0f;
};
PackedGlow pack_glow(const Glow& glow);

// Adds to rgb what the rays collect of the glow, scattered once towards the eye. first, count: of the rays, multiples
// of kSimdWidth. Any thread. Seven parameters: where the glow is known and what it is, the air, along what, which part,
// and where it goes.
void add_glow(const Probes& probes, const PackedGlow& glow, const Air& air, const AirRays& rays, std::size_t first,
              std::size_t count, float* const* rgb);

}  // namespace gonio::lighting
