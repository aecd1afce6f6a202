#include "server/trace/geometry.h"

#include <embree3/rtcore.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "server/scene/scene.h"
#include "server/trace/embree_isa.h"
#include "server/trace/sampler.h"
#include "server/trace/texture.h"

namespace gonio::trace {

// What lets more than this pass has no surface of its own.
constexpr float kAllPasses = 0.998f;
// Transmissive surfaces on a ray, beyond which it ends; and what of light is none.
constexpr int kMostPanes = 64;
constexpr float kNoLight = 1e-6f;
// Least cosine between a mapped normal and the surface's own.
constexpr float kLeastUp = 0.01f;

// Of all devices that are made from now on.
static std::string& embree_isa() {
    static std::string isa;
    return isa;
}

void set_embree_isa(const std::string& isa) {
    embree_isa() = isa;
}

struct Geometry::Embree {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    RTCScene panes = nullptr;  // transmissive surfaces, by the same numbers; null: there are none

    Embree() {
        // Built on the caller's thread: idle callers stay idle.
        const std::string isa = embree_isa().empty() ? "" : ",isa=" + embree_isa();
        device = rtcNewDevice(("threads=1" + isa).c_str());
        if (device == nullptr) throw std::runtime_error("Embree cannot be started on this machine");
        scene = new_scene();
    }
    RTCScene new_scene() const {
        const RTCScene made = rtcNewScene(device);
        rtcSetSceneFlags(made, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
        rtcSetSceneBuildQuality(made, RTC_BUILD_QUALITY_HIGH);
        return made;
    }
    Embree(const Embree&) = delete;
    Embree& operator=(const Embree&) = delete;
    ~Embree() {
        rtcReleaseScene(scene);
        if (panes != nullptr) rtcReleaseScene(panes);
        rtcReleaseDevice(device);
    }

    struct Context {
        RTCIntersectContext base;
        const Geometry* geometry;

        Context(const Geometry& of, bool coherent = false) : base{}, geometry(&of) {
            rtcInitIntersectContext(&base);
            if (coherent) base.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        }
    };

    // Turns down hits on holes of alpha-masked surfaces.
    static void filter(const RTCFilterFunctionNArguments* args) {
        const auto* part = static_cast<const Part*>(args->geometryUserPtr);
        const auto* context = reinterpret_cast<const Context*>(args->context);
        for (unsigned i = 0; i < args->N; ++i) {
            const auto triangle = static_cast<int>(RTCHitN_primID(args->hit, args->N, i));
            if (args->valid[i] == -1 && context->geometry->is_hole(*part, triangle, RTCHitN_u(args->hit, args->N, i),
                                                                   RTCHitN_v(args->hit, args->N, i)))
                args->valid[i] = 0;
        }
    }
    // For viewers: turns down hits on the backs of single-sided surfaces.
    static void front_filter(const RTCFilterFunctionNArguments* args) {
        const auto* part = static_cast<const Part*>(args->geometryUserPtr);
        if (!part->material->culled_back()) return;
        for (unsigned i = 0; i < args->N; ++i) {
            const glm::vec3 d(RTCRayN_dir_x(args->ray, args->N, i), RTCRayN_dir_y(args->ray, args->N, i),
                              RTCRayN_dir_z(args->ray, args->N, i));
            const glm::vec3 n(RTCHitN_Ng_x(args->hit, args->N, i), RTCHitN_Ng_y(args->hit, args->N, i),
                              RTCHitN_Ng_z(args->hit, args->N, i));
            if (glm::dot(d, n) > 0.0f) args->valid[i] = 0;
        }
    }
};

Geometry::Geometry(std::shared_ptr<const SceneAsset> asset) : asset_(std::move(asset)), embree_(new Embree) {
    if (!asset_->instances.empty()) {
        origin_ = 0.5 * (asset_->bounds.min + asset_->bounds.max);
        extent_ = static_cast<float>(0.5 * glm::length(asset_->bounds.max - asset_->bounds.min));
    }
    parts_.resize(asset_->instances.size());
    for (std::size_t i = 0; i < parts_.size(); ++i) {
        const Instance& instance = asset_->instances[i];
        Part& part = parts_[i];
        part.mesh = &asset_->meshes[static_cast<std::size_t>(instance.mesh)];
        part.material = &asset_->materials[static_cast<std::size_t>(part.mesh->material)];
        const glm::dmat3 turn(instance.world_from_mesh);
        // The cofactor matrix carries normals also where the transform is singular.
        const glm::dmat3 cofactor(glm::cross(turn[1], turn[2]), glm::cross(turn[2], turn[0]),
                                  glm::cross(turn[0], turn[1]));
        const double scale =
            std::max({glm::length(cofactor[0]), glm::length(cofactor[1]), glm::length(cofactor[2]), 1e-300});
        part.normal_from_mesh = glm::mat3(cofactor / scale);
        part.local_from_mesh = glm::mat3(turn);
        part.positions.reserve(part.mesh->vertices.size());
        for (const Vertex& vertex : part.mesh->vertices) {
            part.positions.push_back(
                local(glm::dvec3(instance.world_from_mesh * glm::dvec4(glm::dvec3(vertex.position), 1.0))));
        }
        // Embree reads 16 bytes at the last vertex.
        part.positions.emplace_back(0.0f);
        RTCGeometry geometry = rtcNewGeometry(embree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, part.positions.data(), 0,
                                   sizeof(glm::vec3), part.mesh->vertices.size());
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, part.mesh->indices.data(), 0,
                                   12, part.mesh->indices.size() / 3);
        rtcSetGeometryUserData(geometry, &part);
        if (part.material->alpha_mask) {
            rtcSetGeometryOccludedFilterFunction(geometry, Embree::filter);
            rtcSetGeometryIntersectFilterFunction(geometry, Embree::filter);
        }
        rtcCommitGeometry(geometry);
        const bool pane = part.material->transmissive();
        if (pane && embree_->panes == nullptr) embree_->panes = embree_->new_scene();
        rtcAttachGeometryByID(pane ? embree_->panes : embree_->scene, geometry, static_cast<unsigned>(i));
        rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(embree_->scene);
    if (embree_->panes != nullptr) rtcCommitScene(embree_->panes);
    if (const RTCError error = rtcGetDeviceError(embree_->device); error != RTC_ERROR_NONE) {
        throw std::runtime_error("Embree cannot hold the scene (error " + std::to_string(error) + ")");
    }
}

Geometry::~Geometry() = default;

float Geometry::step_off(const glm::vec3& p) const {
    const float greatest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    return std::max(8e-6f * std::min(greatest, extent_), 1e-6f * extent_);  // far beyond there are no surfaces
}

std::array<glm::vec3, 3> Geometry::corners(int instance, int triangle) const {
    const Part& part = parts_[static_cast<std::size_t>(instance)];
    const std::uint32_t* index = &part.mesh->indices[static_cast<std::size_t>(triangle) * 3];
    return {part.positions[index[0]], part.positions[index[1]], part.positions[index[2]]};
}

glm::vec2 Geometry::uv_at(const Part& part, int triangle, float u, float v) const {
    const std::uint32_t* index = &part.mesh->indices[static_cast<std::size_t>(triangle) * 3];
    const std::vector<Vertex>& vertices = part.mesh->vertices;
    return (1.0f - u - v) * vertices[index[0]].uv + u * vertices[index[1]].uv + v * vertices[index[2]].uv;
}

glm::vec4 textured(const SceneAsset& asset, const Material& material, glm::vec4 color, int image, glm::vec2 uv) {
    if (image < 0) return color;
    return color * sample(asset.images[static_cast<std::size_t>(image)], uv, material.wrap_s, material.wrap_t);
}

glm::vec4 Geometry::base_color_at(const Part& part, int triangle, float u, float v) const {
    const Material& material = *part.material;
    glm::vec4 color = material.base_color;
    if (const auto& colors = part.mesh->colors; !colors.empty()) {
        const std::uint32_t* index = &part.mesh->indices[static_cast<std::size_t>(triangle) * 3];
        color *= ((1.0f - u - v) * glm::vec4(colors[index[0]]) + u * glm::vec4(colors[index[1]]) +
                  v * glm::vec4(colors[index[2]])) /
                 65535.0f;
    }
    return textured(*asset_, material, color, material.base_color_image, uv_at(part, triangle, u, v));
}

bool Geometry::is_hole(const Part& part, int triangle, float u, float v) const {
    return part.material->alpha_mask && base_color_at(part, triangle, u, v).a < part.material->alpha_cutoff;
}

// What names a point, and what is asked of it: seven numbers.
bool Geometry::surface_at(int instance, int triangle, float u, float v, bool front, SurfaceHit& hit,
                          bool colours) const {
    if (is_hole(parts_[static_cast<std::size_t>(instance)], triangle, u, v)) return false;
    if (transparency_at(instance, triangle, u, v).share > kAllPasses) return false;
    const auto c = corners(instance, triangle);
    const glm::vec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
    const float length2 = glm::dot(normal, normal);
    if (!(length2 > 0.0f)) return false;
    const glm::vec3 unit = normal / std::sqrt(length2);
    hit = surface(static_cast<unsigned>(instance), static_cast<unsigned>(triangle), u, v, unit, front ? -unit : unit,
                  colours);
    return true;
}

glm::vec3 Geometry::emission_at(int instance, int triangle, float u, float v) const {
    const Part& part = parts_[static_cast<std::size_t>(instance)];
    const Material& material = *part.material;
    if (material.emissive_nit == glm::vec3(0.0f)) return material.emissive_nit;
    return glm::vec3(textured(*asset_, material, glm::vec4(material.emissive_nit, 1.0f), material.emissive_image,
                              uv_at(part, triangle, u, v)));
}

static RTCRay ray_of(const glm::vec3& from, const glm::vec3& along, float near, float far) {
    RTCRay ray{};
    ray.org_x = from.x, ray.org_y = from.y, ray.org_z = from.z;
    ray.dir_x = along.x, ray.dir_y = along.y, ray.dir_z = along.z;
    ray.tnear = near;
    ray.tfar = far;
    ray.mask = ~0u;
    return ray;
}

struct Geometry::RayState {
    Embree::Context context;
    RTCRayHit query{};

    RayState(const Geometry& of, const RTCRay& ray) : context(of) { query.ray = ray; }
    // Result: whether the ray meets a surface of the scene before its end, which is there from now on.
    bool meets(RTCScene scene) {
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene, &context.base, &query);
        return query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
};

// From one transmissive surface to the next, until one stops the ray: stops(instance, triangle, transparency). Result:
// whether one does; the ray then has it. Two that meet at an edge count once.
template <typename Stops>
bool Geometry::follow_panes(RayState& ray, Stops stops) const {
    RTCRay& own = ray.query.ray;
    const glm::vec3 from(own.org_x, own.org_y, own.org_z), along(own.dir_x, own.dir_y, own.dir_z);
    const float end = own.tfar, per_m = 1.0f / std::max(glm::length(along), 1e-30f);
    for (int pane = 0; ray.meets(embree_->panes); ++pane) {
        const RTCHit& at = ray.query.hit;
        const auto instance = static_cast<int>(at.geomID), triangle = static_cast<int>(at.primID);
        if (pane == kMostPanes || stops(instance, triangle, transparency_at(instance, triangle, at.u, at.v)))
            return true;
        own.tnear = own.tfar + std::max(step_off(from + along * own.tfar) * per_m, 1e-6f * own.tfar);
        own.tfar = end;
        if (!(own.tnear < end)) return false;
    }
    return false;
}

namespace {

// A number in [0, 1) for a ray and a surface that it may pass.
float chance(std::uint32_t dice, int instance, int triangle) {
    return unit_interval(
        mix_bits(mix_bits(dice, static_cast<std::uint32_t>(instance)), static_cast<std::uint32_t>(triangle)));
}

// Bits of a ray: the same for the same ray.
std::uint32_t dice_of(const RayPacket& rays, int i) {
    std::uint32_t bits = 0x7f4a7c15u;
    for (const float* values : {rays.from_x, rays.from_y, rays.from_z, rays.along_x, rays.along_y, rays.along_z})
        bits = mix_bits(bits, std::bit_cast<std::uint32_t>(values[i]));
    return bits;
}

// A ray passes as often as light does, and takes the tint of what it passes. first: in [0, 1), decides of the nearest
// surface, so that stratified samples pass it as stratified; negative: by chance as of the others.
auto passing(std::uint32_t dice, glm::vec3& tint, float first = -1.0f) {
    return [dice, &tint, first](int instance, int triangle, const Transparency& pane) mutable {
        const float drawn = first >= 0.0f ? std::exchange(first, -1.0f) : chance(dice, instance, triangle);
        if (!(drawn < pane.share)) return true;
        tint *= pane.tint;
        return false;
    };
}

// All that passes, until nothing is left.
auto dimming(glm::vec3& passed) {
    return [&passed](int, int, const Transparency& pane) {
        passed *= pane.transmittance();
        return std::max({passed.r, passed.g, passed.b}) < kNoLight;
    };
}

}  // namespace

bool Geometry::transmissive() const {
    return embree_->panes != nullptr;
}

Transparency Geometry::transparency_at(int instance, int triangle, float u, float v) const {
    const Part& part = parts_[static_cast<std::size_t>(instance)];
    if (!part.material->transmissive()) return {};
    return transparency_of(*asset_, *part.material, base_color_at(part, triangle, u, v), uv_at(part, triangle, u, v));
}

bool Geometry::closest(const glm::vec3& from, const glm::vec3& direction, float near, bool for_viewer, SurfaceHit& hit,
                       std::uint32_t dice) const {
    RayState ray(*this, ray_of(from, direction, near, std::numeric_limits<float>::infinity()));
    if (for_viewer) ray.context.base.filter = Embree::front_filter;
    bool met = ray.meets(embree_->scene);
    glm::vec3 tint(1.0f);
    if (embree_->panes != nullptr) {
        RayState panes(*this, ray_of(from, direction, near, ray.query.ray.tfar));
        panes.context.base.filter = ray.context.base.filter;
        if (follow_panes(panes, passing(dice, tint, static_cast<float>(dice) / static_cast<float>(kDice)))) {
            ray.query = panes.query;
            met = true;
        }
    }
    if (!met) return false;
    const RTCRayHit& query = ray.query;
    hit = surface(query.hit.geomID, query.hit.primID, query.hit.u, query.hit.v,
                  {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z}, direction, true);
    hit.normal = detailed_normal(hit, query.hit.u, query.hit.v);
    hit.distance = query.ray.tfar;
    hit.tint = tint;
    return true;
}

// Seven numbers of one hit, as Embree gives them.
SurfaceHit Geometry::surface(unsigned instance, unsigned triangle, float hit_u, float hit_v, glm::vec3 geometric,
                             const glm::vec3& direction, bool colours) const {
    SurfaceHit hit;
    const Part& part = parts_[instance];
    // A hit on an edge would lie in the plane of the wall next to it and see neither side of that: it is taken a little
    // inside its triangle.
    constexpr float kInside = 2e-5f;
    const float u0 = std::max(hit_u, kInside), v0 = std::max(hit_v, kInside);
    const float inside = std::min(1.0f, (1.0f - kInside) / (u0 + v0));
    const float u = u0 * inside, v = v0 * inside;
    hit.instance = static_cast<int>(instance);
    hit.triangle = static_cast<int>(triangle);
    const std::uint32_t* index = &part.mesh->indices[static_cast<std::size_t>(hit.triangle) * 3];
    hit.position =
        (1.0f - u - v) * part.positions[index[0]] + u * part.positions[index[1]] + v * part.positions[index[2]];
    const float scale = std::max({std::abs(geometric.x), std::abs(geometric.y), std::abs(geometric.z)});
    geometric = scale > 0.0f ? glm::normalize(geometric / scale) : -direction;
    // The importer winds mirrored instances so that Embree's Ng, the cross product of the edges, is the front's.
    const bool from_front = glm::dot(geometric, direction) < 0.0f;
    hit.geometric = from_front ? geometric : -geometric;
    const std::vector<Vertex>& vertices = part.mesh->vertices;
    const glm::vec3 smooth = part.normal_from_mesh * ((1.0f - u - v) * vertices[index[0]].normal +
                                                      u * vertices[index[1]].normal + v * vertices[index[2]].normal);
    const float length2 = glm::dot(smooth, smooth);
    hit.normal = length2 > 1e-30f ? smooth * (1.0f / std::sqrt(length2)) : hit.geometric;
    if (glm::dot(hit.normal, hit.geometric) < 0.0f) hit.normal = -hit.normal;
    if (!colours) return hit;
    hit.albedo = glm::vec3(base_color_at(part, hit.triangle, u, v));
    hit.emission =
        from_front || part.material->double_sided ? emission_at(hit.instance, hit.triangle, u, v) : glm::vec3(0.0f);
    return hit;
}

glm::vec3 Geometry::detailed_normal(const SurfaceHit& hit, float u, float v) const {
    const Part& part = parts_[static_cast<std::size_t>(hit.instance)];
    if (part.mesh->tangents.empty()) return hit.normal;
    const Material& material = *part.material;
    const std::uint32_t* index = &part.mesh->indices[static_cast<std::size_t>(hit.triangle) * 3];
    const std::vector<glm::vec4>& tangents = part.mesh->tangents;
    const glm::vec3 along = part.local_from_mesh * glm::vec3((1.0f - u - v) * tangents[index[0]] +
                                                             u * tangents[index[1]] + v * tangents[index[2]]);
    const auto corner = corners(hit.instance, hit.triangle);
    const bool front = glm::dot(glm::cross(corner[1] - corner[0], corner[2] - corner[0]), hit.geometric) > 0.0f;
    const glm::vec3 smooth = front ? hit.normal : -hit.normal, flat = along - smooth * glm::dot(smooth, along);
    const float length = glm::length(flat);
    if (!(length > 1e-12f)) return hit.normal;
    const glm::vec3 tangent = flat / length, up = glm::cross(smooth, tangent) * tangents[index[0]].w;
    const glm::vec3 texel(
        textured(*asset_, material, glm::vec4(1.0f), material.normal_image, uv_at(part, hit.triangle, u, v)));
    const glm::vec3 own =
        glm::vec3(glm::vec2(texel) * 2.0f - 1.0f, 1.0f) *
        glm::vec3(material.normal_scale, material.normal_scale, std::max(texel.b * 2.0f - 1.0f, kLeastUp));
    glm::vec3 mapped = glm::normalize(tangent * own.x + up * own.y + smooth * own.z) * (front ? 1.0f : -1.0f);
    // Beyond the triangle's own horizon nothing is seen of it.
    const float above = glm::dot(mapped, hit.geometric);
    if (above < kLeastUp) mapped = glm::normalize(mapped + hit.geometric * (kLeastUp - above));
    return mapped;
}

bool Geometry::occluded(const glm::vec3& from, const glm::vec3& to) const {
    Embree::Context context(*this);
    RTCRay ray = ray_of(from, to - from, 0.0f, 1.0f - 1e-5f);  // a luminaire mounted on a surface is not hidden by it
    rtcOccluded1(embree_->scene, &context.base, &ray);
    return ray.tfar < 0.0f;
}

namespace {

// Embree's form of a packet; valid: -1 for active rays.
void fill(RTCRay16& to, int* valid, const RayPacket& from, unsigned active) {
    static_assert(sizeof(from.from_x) == sizeof(to.org_x));
    constexpr std::size_t kBytes = sizeof(to.org_x);
    std::memcpy(to.org_x, from.from_x, kBytes);
    std::memcpy(to.org_y, from.from_y, kBytes);
    std::memcpy(to.org_z, from.from_z, kBytes);
    std::memcpy(to.dir_x, from.along_x, kBytes);
    std::memcpy(to.dir_y, from.along_y, kBytes);
    std::memcpy(to.dir_z, from.along_z, kBytes);
    std::memcpy(to.tfar, from.far, kBytes);
    std::memset(to.tnear, 0, kBytes);
    std::memset(to.time, 0, kBytes);
    std::memset(to.mask, 0xff, kBytes);
    std::memset(to.id, 0, kBytes);
    std::memset(to.flags, 0, kBytes);
    for (int i = 0; i < kPacket; ++i) valid[i] = -static_cast<int>(active >> i & 1u);
    // Where Embree has no packets of sixteen (AVX2) it does not ask `valid`: rays that are none must be empty, not what
    // happens to be there.
    for (int i = 0; i < kPacket && active != (1u << kPacket) - 1u; ++i) {
        if (valid[i] != 0) continue;
        for (float* const values : {to.org_x, to.org_y, to.org_z, to.dir_x, to.dir_y, to.dir_z}) values[i] = 0.0f;
        to.tfar[i] = -1.0f;
    }
}

}  // namespace

glm::vec3 Geometry::transmittance(const glm::vec3& from, const glm::vec3& to) const {
    glm::vec3 passed(1.0f);
    if (occluded(from, to)) return glm::vec3(0.0f);
    if (embree_->panes == nullptr) return passed;
    RayState ray(*this, ray_of(from, to - from, 0.0f, 1.0f - 1e-5f));
    return follow_panes(ray, dimming(passed)) ? glm::vec3(0.0f) : passed;
}

void Geometry::transmittance(const RayPacket& rays, unsigned active, glm::vec3* passed) const {
    if (embree_->panes == nullptr || active == 0) return;
    const unsigned touching = touches_panes(rays, active, rays.far);
    for (int i = 0; i < kPacket; ++i) {
        if ((touching >> i & 1u) == 0) continue;
        RayState ray(*this, ray_of(rays.from(i), rays.along(i), 0.0f, rays.far[i]));
        if (follow_panes(ray, dimming(passed[i]))) passed[i] = glm::vec3(0.0f);
    }
}

unsigned Geometry::touches_panes(const RayPacket& rays, unsigned active, const float* far) const {
    Embree::Context context(*this);
    alignas(64) RTCRay16 query;
    alignas(64) int valid[kPacket];
    fill(query, valid, rays, active);
    for (int i = 0; i < kPacket; ++i)
        if (valid[i] != 0) query.tfar[i] = far[i];
    rtcOccluded16(valid, embree_->panes, &context.base, &query);
    unsigned touching = 0;
    for (int i = 0; i < kPacket; ++i) touching |= (query.tfar[i] < 0.0f ? 1u : 0u) << i;
    return touching & active;
}

// met and hits: of what is opaque. Result: as of met, with the transmissive surfaces that stop rays.
unsigned Geometry::through_panes(const RayPacket& rays, unsigned active, unsigned met, HitPacket& hits,
                                 glm::vec3* tints) const {
    const unsigned touching = touches_panes(rays, active, hits.distance);
    for (int i = 0; i < kPacket; ++i) {
        if ((touching >> i & 1u) == 0) continue;
        RayState ray(*this, ray_of(rays.from(i), rays.along(i), 0.0f, hits.distance[i]));
        const std::uint32_t dice = dice_of(rays, i);
        bool taken = false;
        const auto by_luminance = [&](int instance, int triangle, const Transparency& pane) {
            const float number = chance(dice, instance, triangle);
            if (number < luminous(pane.transmittance())) return false;
            taken = number < pane.share;
            return true;
        };
        const bool stopped =
            tints != nullptr ? follow_panes(ray, passing(dice, tints[i])) : follow_panes(ray, by_luminance);
        if (taken) met &= ~(1u << i);
        if (!stopped || taken) continue;
        met |= 1u << i;
        const RTCHit& hit = ray.query.hit;
        hits.distance[i] = ray.query.ray.tfar;
        hits.u[i] = hit.u, hits.v[i] = hit.v;
        hits.normal_x[i] = hit.Ng_x, hits.normal_y[i] = hit.Ng_y, hits.normal_z[i] = hit.Ng_z;
        hits.instance[i] = hit.geomID, hits.triangle[i] = hit.primID;
    }
    return met;
}

unsigned Geometry::occluded(const RayPacket& rays, unsigned active, bool coherent) const {
    Embree::Context context(*this, coherent);
    alignas(64) RTCRay16 query;
    alignas(64) int valid[kPacket];
    fill(query, valid, rays, active);
    rtcOccluded16(valid, embree_->scene, &context.base, &query);
    unsigned stopped = 0;
    for (int i = 0; i < kPacket; ++i) stopped |= (query.tfar[i] < 0.0f ? 1u : 0u) << i;
    return stopped & active;
}

unsigned Geometry::closest(const RayPacket& rays, unsigned active, HitPacket& hits) const {
    return closest(rays, active, hits, nullptr);
}

unsigned Geometry::closest(const RayPacket& rays, unsigned active, HitPacket& hits, glm::vec3* tints) const {
    Embree::Context context(*this);
    alignas(64) RTCRayHit16 query;
    alignas(64) int valid[kPacket];
    fill(query.ray, valid, rays, active);
    for (int i = 0; i < kPacket; ++i) query.hit.geomID[i] = query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect16(valid, embree_->scene, &context.base, &query);
    unsigned met = 0;
    for (int i = 0; i < kPacket; ++i) {
        hits.distance[i] = query.ray.tfar[i];
        hits.u[i] = query.hit.u[i], hits.v[i] = query.hit.v[i];
        hits.normal_x[i] = query.hit.Ng_x[i], hits.normal_y[i] = query.hit.Ng_y[i],
        hits.normal_z[i] = query.hit.Ng_z[i];
        hits.instance[i] = query.hit.geomID[i], hits.triangle[i] = query.hit.primID[i];
        met |= (query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID ? 1u : 0u) << i;
    }
    met &= active;
    return embree_->panes == nullptr ? met : through_panes(rays, active, met, hits, tints);
}

unsigned Geometry::closest(const RayPacket& rays, unsigned active, SurfaceHit* hits, bool colours) const {
    HitPacket met_at;
    glm::vec3 tints[kPacket];
    std::fill_n(tints, kPacket, glm::vec3(1.0f));
    const unsigned met = closest(rays, active, met_at, tints);
    for (int i = 0; i < kPacket; ++i) {
        if ((met >> i & 1u) == 0) continue;
        hits[i] = surface(met_at.instance[i], met_at.triangle[i], met_at.u[i], met_at.v[i], met_at.normal(i),
                          rays.along(i), colours);
        hits[i].distance = met_at.distance[i];
        hits[i].tint = tints[i];
    }
    return met;
}

Transparency transparency_of(const SceneAsset& asset, const Material& material, const glm::vec4& color, glm::vec2 uv) {
    float passes = material.transmission;
    if (material.transmission_image >= 0)
        passes *= textured(asset, material, glm::vec4(1.0f), material.transmission_image, uv).r;
    const float covered = material.alpha_blend ? std::clamp(color.a, 0.0f, 1.0f) : 1.0f,
                share = 1.0f - covered * (1.0f - passes);
    if (!(share > 0.0f)) return {};
    return {share, ((1.0f - covered) + covered * passes * glm::vec3(color)) / share};
}

float luminous(const glm::vec3& passed) {
    return passed.r == passed.g && passed.g == passed.b ? passed.r
                                                        : glm::dot(passed, glm::vec3(0.2126f, 0.7152f, 0.0722f));
}

std::shared_ptr<const Geometry> geometry_of(const Scene& scene) {
    return scene.traced ? scene.traced : std::make_shared<const Geometry>(scene.asset);
}

}  // namespace gonio::trace
