// A scene's surfaces as rays meet them: Embree's acceleration structure over the meshes of an asset. Immutable after
// construction, any thread. All coordinates are local: relative to origin(), world axes, metres, so that a scene far
// from the world's origin loses no precision. Embree's types stay in geometry.cpp.
#pragma once

#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "server/scene/asset.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::trace {

// A point on one side of a surface.
struct SurfacePoint {
    glm::vec3 position{0.0f};   // local, m
    glm::vec3 normal{0.0f};     // shading, unit
    glm::vec3 geometric{0.0f};  // the triangle's own, unit
};

// How a surface lets light pass straight on: of `share` of it each channel keeps `tint`. The rest meets the surface.
struct Transparency {
    float share = 0.0f;  // 0..1
    glm::vec3 tint{1.0f};
    glm::vec3 transmittance() const { return share * tint; }
};

// What a ray met. Normals are turned to the side that the ray came from.
struct SurfaceHit : SurfacePoint {
    glm::vec3 albedo{0.0f};    // linear reflectance 0..1
    glm::vec3 emission{0.0f};  // cd/m² towards the ray's origin
    float distance = 0.0f;     // m
    glm::vec3 tint{1.0f};      // of the surfaces that the ray passed before, by chance as much as light passes
    int instance = 0, triangle = 0;
};

// Sixteen rays; directions need not be of unit length: distances are in units of them.
inline constexpr int kPacket = 16;
struct alignas(64) RayPacket {
    float from_x[kPacket], from_y[kPacket], from_z[kPacket];
    float along_x[kPacket], along_y[kPacket], along_z[kPacket];
    float far[kPacket];
    void set(int i, const glm::vec3& from, const glm::vec3& along,
             float far_along = std::numeric_limits<float>::infinity()) {
        from_x[i] = from.x, from_y[i] = from.y, from_z[i] = from.z;
        along_x[i] = along.x, along_y[i] = along.y, along_z[i] = along.z;
        far[i] = far_along;
    }
    glm::vec3 from(int i) const { return {from_x[i], from_y[i], from_z[i]}; }
    glm::vec3 along(int i) const { return {along_x[i], along_y[i], along_z[i]}; }
    glm::vec3 at(int i, float distance) const {
        return glm::vec3(from_x[i], from_y[i], from_z[i]) + along(i) * distance;
    }
};
// What they meet: distance, the triangle's plane (of any length, its front's) and where on it.
struct alignas(64) HitPacket {
    float distance[kPacket], u[kPacket], v[kPacket];
    float normal_x[kPacket], normal_y[kPacket], normal_z[kPacket];
    unsigned instance[kPacket], triangle[kPacket];
    glm::vec3 normal(int i) const { return {normal_x[i], normal_y[i], normal_z[i]}; }
};

class Geometry {
public:
    explicit Geometry(std::shared_ptr<const SceneAsset> asset);
    ~Geometry();

    const SceneAsset& asset() const { return *asset_; }
    const glm::dvec3& origin() const { return origin_; }
    glm::vec3 local(const glm::dvec3& world) const { return glm::vec3(world - origin_); }

    static constexpr std::uint32_t kDice = 1u << 24;
    // Result: whether the ray meets a surface beyond `near` and, if so, which, normal maps included: packets of rays
    // know none. direction: unit. Alpha-masked texels are holes. for_viewer: backs of single-sided surfaces are left
    // out, as glTF's viewers do; light meets both sides. The ray passes transmissive surfaces by dice, which is uniform
    // in 0 … kDice − 1. It passes the nearest one where dice / kDice is less than the share that this lets pass.
    bool closest(const glm::vec3& from, const glm::vec3& direction, float near, bool for_viewer, SurfaceHit& hit,
                 std::uint32_t dice = 0) const;
    // Result: whether a surface stands between two points, both a step away from their own surfaces. Transmissive ones
    // stop nothing: transmittance() has what they let pass.
    bool occluded(const glm::vec3& from, const glm::vec3& to) const;
    // Result: what passes between the two points, 0..1 per channel; exactly 1 where nothing is, 0 where it is stopped.
    glm::vec3 transmittance(const glm::vec3& from, const glm::vec3& to) const;
    // Sets what passes transmissive surfaces along the rays of `active` before `far`; others of kPacket stay.
    void transmittance(const RayPacket& rays, unsigned active, glm::vec3* passed) const;
    // Whether any surface is transmissive. Where none is all this costs nothing.
    bool transmissive() const;
    // Result: of a surface that is not transmissive: share 0.
    Transparency transparency_at(int instance, int triangle, float u, float v) const;
    // The same for the rays of `active` (bit i: ray i). Result: bits of those that meet a surface before `far`.
    // coherent: the rays lie side by side.
    unsigned occluded(const RayPacket& rays, unsigned active, bool coherent = false) const;
    // The same for the nearest surface. hits: kPacket, filled where the result has a bit. colours: albedo and emission
    // are asked for. A ray passes transmissive surfaces by chance, as often as light does. Where a hit has no tint that
    // is by luminance, and what coloured glass takes meets nothing.
    unsigned closest(const RayPacket& rays, unsigned active, SurfaceHit* hits, bool colours = true) const;
    unsigned closest(const RayPacket& rays, unsigned active, HitPacket& hits) const;
    // Result: a step along a normal that leaves the surface at p for certain, m: about a hundred roundings of p.
    float step_off(const glm::vec3& p) const;
    // Half the scene's diagonal, m.
    float extent() const { return extent_; }

    // What a ray would meet at barycentric (u, v) on the front or the back of a triangle; distance 0. Result:
    // false in a hole of an alpha mask, or where the triangle has no area.
    bool surface_at(int instance, int triangle, float u, float v, bool front, SurfaceHit& hit,
                    bool colours = true) const;

    // Returns the shading normal at barycentric (u, v) as the normal map has it; where there is none, hit.normal. hit:
    // of closest() or surface_at().
    glm::vec3 detailed_normal(const SurfaceHit& hit, float u, float v) const;

    // Corners of an instance's triangles by its mesh's indices, local, m.
    std::span<const glm::vec3> positions(int instance) const {
        const Part& part = parts_[static_cast<std::size_t>(instance)];
        return std::span(part.positions).first(part.mesh->vertices.size());
    }
    // A triangle's corners, local, m.
    std::array<glm::vec3, 3> corners(int instance, int triangle) const;
    // Result: emission of the front at barycentric (u, v), cd/m².
    glm::vec3 emission_at(int instance, int triangle, float u, float v) const;

private:
    struct Embree;
    struct Part {  // an instance: user data of its Embree geometry
        const Mesh* mesh = nullptr;
        const Material* material = nullptr;
        glm::mat3 normal_from_mesh{1.0f}, local_from_mesh{1.0f};
        std::vector<glm::vec3> positions;  // local, m; shared with Embree
    };
    friend struct Embree;
    SurfaceHit surface(unsigned instance, unsigned triangle, float u, float v, glm::vec3 geometric,
                       const glm::vec3& direction, bool colours) const;
    glm::vec4 base_color_at(const Part& part, int triangle, float u, float v) const;
    struct RayState;
    template <typename Stops>
    bool follow_panes(RayState& ray, Stops stops) const;
    unsigned closest(const RayPacket& rays, unsigned active, HitPacket& hits, glm::vec3* tints) const;
    unsigned touches_panes(const RayPacket& rays, unsigned active, const float* far) const;
    unsigned through_panes(const RayPacket& rays, unsigned active, unsigned met, HitPacket& hits,
                           glm::vec3* tints) const;
    bool is_hole(const Part& part, int triangle, float u, float v) const;
    glm::vec2 uv_at(const Part& part, int triangle, float u, float v) const;

    std::shared_ptr<const SceneAsset> asset_;
    glm::dvec3 origin_{0.0};
    float extent_ = 1.0f;  // half diagonal, m
    std::vector<Part> parts_;
    std::unique_ptr<Embree> embree_;
};

// Result: color × an image of the asset (-1: none) at uv, as the material repeats it.
glm::vec4 textured(const SceneAsset& asset, const Material& material, glm::vec4 color, int image, glm::vec2 uv);

// Result: as of Geometry::transparency_at, where the base colour with its texture is `color`.
Transparency transparency_of(const SceneAsset& asset, const Material& material, const glm::vec4& color, glm::vec2 uv);
// Result: what of light without a colour passes; for values of one channel.
float luminous(const glm::vec3& passed);

// Result: the scene's own, or one that is made now, which takes long.
std::shared_ptr<const Geometry> geometry_of(const Scene& scene);

// Rays to what may be hidden, given one by one and asked sixteen at a time: done(payload, passed), in order;
// the last with send(). passed: 0 … 1 per channel.
template <typename Payload, typename Done>
class ShadowRays {
public:
    ShadowRays(const Geometry& geometry, Done done) : geometry_(geometry), done_(std::move(done)) {}
    void add(const glm::vec3& from, const glm::vec3& along, float far_along, const Payload& payload) {
        rays_.set(waiting_, from, along, far_along);
        payloads_[waiting_++] = payload;
        if (waiting_ == kPacket) send();
    }
    void send() {
        if (waiting_ == 0) return;
        const unsigned hidden = geometry_.occluded(rays_, ~0u >> (32 - waiting_));
        glm::vec3 passed[kPacket];
        for (int i = 0; i < waiting_; ++i) passed[i] = glm::vec3((hidden >> i & 1u) != 0 ? 0.0f : 1.0f);
        if (geometry_.transmissive()) geometry_.transmittance(rays_, ~hidden & ~0u >> (32 - waiting_), passed);
        for (int i = 0; i < waiting_; ++i) done_(payloads_[i], passed[i]);
        waiting_ = 0;
    }

private:
    const Geometry& geometry_;
    Done done_;
    RayPacket rays_;
    Payload payloads_[kPacket];
    int waiting_ = 0;
};

}  // namespace gonio::trace
