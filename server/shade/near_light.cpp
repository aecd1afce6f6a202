#include "server/shade/near_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/shade/merged.h"
#include "server/trace/sampler.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/shade/near_light.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef GONIO_SHADE_NEAR_HITS
#define GONIO_SHADE_NEAR_HITS
namespace gonio::shade {
// What the kernel below sees of a luminaire.
struct NearView {
    glm::vec3 position;  // local, m
    glm::mat3 light_from_world;
    Web web;
    const float* densities;    // DirectionTable
    float extent_m;            // of the scene
    float kappa_per_count_pi;  // kappa / (VPLs · pi)
};
}  // namespace gonio::shade
#endif

HWY_BEFORE_NAMESPACE();
namespace gonio::shade {
namespace HWY_NAMESPACE {

#include "server/shade/lanes.h"
#include "server/shade/look_lanes.h"
#include "server/shade/web_lanes.h"

HWY_INLINE Vec3 load3(const float* x, const float* y, const float* z, std::size_t at) {
    return {load(x + at), load(y + at), load(z + at)};
}
HWY_INLINE void store3(const Vec3& v, float* x, float* y, float* z, std::size_t at) {
    store(v.x, x + at), store(v.y, y + at), store(v.z, z + at);
}
HWY_INLINE Float where(Mask mask, Float yes) {
    return hn::IfThenElseZero(mask, yes.raw);
}
// trace::Geometry::step_off for lanes.
HWY_INLINE Float step_off(const Vec3& p, float extent_m) {
    return max(Float(8e-6f) * max(max(abs(p.x), abs(p.y)), abs(p.z)), Float(1e-6f * extent_m));
}

// Rays from points, four steps off their surfaces, along about_z turned to their normals (trace::around for lanes).
void ShortRays(const Points& points, const Directions& about_z, float extent_m, float far, trace::RayPacket& rays) {
    for (std::size_t i = 0; i < trace::kPacket; i += hn::Lanes(Tag())) {
        const Vec3 p = load3(points.x, points.y, points.z, i), n = load3(points.nx, points.ny, points.nz, i),
                   v = load3(about_z.x, about_z.y, about_z.z, i);
        store3(p + n * (Float(4.0f) * step_off(p, extent_m)), rays.from_x, rays.from_y, rays.from_z, i);
        const Float sign = hn::CopySign(hn::Set(Tag(), 1.0f), n.z.raw), a = Float(-1.0f) / (sign + n.z),
                    b = n.x * n.y * a;
        const Vec3 tangent(Float(1.0f) + sign * n.x * n.x * a, sign * b, -(sign * n.x)),
            bitangent(b, sign + n.y * n.y * a, -n.y);
        store3(tangent * v.x + bitangent * v.y + n * v.z, rays.along_x, rays.along_y, rays.along_z, i);
        store(Float(far), rays.far + i);
    }
}

// What the luminaire does at the surfaces met, if nothing stands between: sums' light, and in `rays` the way there.
void Brings(const NearView& light, const Looks& looks, const trace::HitPacket& hits, const Points& points,
            trace::RayPacket& rays, NearSums& out) {
    const Tag tag;
    const IntTag ints;
    static_assert(sizeof(Looks::Triangle) == 16 && sizeof(Looks::Paint) == 32 && sizeof(Looks::Place) == 28);
    const glm::mat3& m = light.light_from_world;
    for (std::size_t i = 0; i < trace::kPacket; i += hn::Lanes(tag)) {
        const auto instance = hn::Load(ints, reinterpret_cast<const std::int32_t*>(hits.instance) + i);
        const auto zero = hn::Zero(ints);
        Mask good = hn::RebindMask(tag, hn::Gt(instance, hn::Set(ints, -1)));
        const auto first = hn::GatherIndex(ints, reinterpret_cast<const std::int32_t*>(looks.first_triangle.data()),
                                           hn::Max(instance, zero));
        const auto triangle = hn::IfThenElseZero(
            hn::RebindMask(ints, good),
            hn::Add(first, hn::Load(ints, reinterpret_cast<const std::int32_t*>(hits.triangle) + i)));
        const auto look = [&](int word) {
            return hn::GatherIndex(ints, reinterpret_cast<const std::int32_t*>(looks.triangles.data()) + word,
                                   hn::ShiftLeft<2>(triangle));
        };
        const Vec3 along = load3(rays.along_x, rays.along_y, rays.along_z, i);
        const Float distance = mix(Float(1.0f), load(hits.distance + i), good);
        const Vec3 y = load3(rays.from_x, rays.from_y, rays.from_z, i) + along * distance;
        // Both normals towards the ray's origin. Lanes that met nothing hold anything: they get numbers.
        Vec3 plane = load3(hits.normal_x, hits.normal_y, hits.normal_z, i);
        plane = Vec3(where(good, plane.x), where(good, plane.y), where(good, plane.z));
        plane = plane * inversesqrt(max(dot(plane, plane), Float(1e-37f)));
        plane = plane * Float(hn::CopySign(hn::Set(tag, 1.0f), (-dot(plane, along)).raw));
        const Float u = where(good, load(hits.u + i)), v = where(good, load(hits.v + i)), w = Float(1.0f) - u - v;
        Vec3 normal = unpack_normal(look(0)) * w + unpack_normal(look(1)) * u + unpack_normal(look(2)) * v;
        normal = normal * inversesqrt(max(dot(normal, normal), Float(1e-30f)));
        normal = normal * Float(hn::CopySign(hn::Set(tag, 1.0f), dot(normal, plane).raw));

        const Vec3 from = y + plane * step_off(y, light.extent_m);
        const Vec3 d = from - Vec3(light.position.x, light.position.y, light.position.z);
        const Float d2 = max(dot(d, d), Float(1e-30f)), per_d = inversesqrt(d2);
        const Float cosine = -dot(d, normal) * per_d, facing = -dot(d, plane) * per_d;
        good = hn::And(good, hn::Gt(min(cosine, facing).raw, hn::Zero(tag)));
        if (hn::AllFalse(tag, good)) {
            store3(Vec3(), out.red, out.green, out.blue, i);
            continue;
        }
        const Vec3 in_light(Float(m[0][0]) * d.x + Float(m[1][0]) * d.y + Float(m[2][0]) * d.z,
                            Float(m[0][1]) * d.x + Float(m[1][1]) * d.y + Float(m[2][1]) * d.z,
                            Float(m[0][2]) * d.x + Float(m[1][2]) * d.y + Float(m[2][2]) * d.z);
        const Float ratio = web_ratio(light.web, in_light);
        // The area that a VPL here would stand for: d² / (count · density · facing).
        const Vec2 angles = web_angles(0, in_light);
        constexpr float kRows = trace::DirectionTable::kPolar / std::numbers::pi_v<float>,
                        kColumns = trace::DirectionTable::kAzimuth / (2.0f * std::numbers::pi_v<float>);
        const auto row = hn::Min(hn::ConvertTo(ints, (angles.x * Float(kRows)).raw),
                                 hn::Set(ints, trace::DirectionTable::kPolar - 1)),
                   column = hn::Min(hn::ConvertTo(ints, (angles.y * Float(kColumns)).raw),
                                    hn::Set(ints, trace::DirectionTable::kAzimuth - 1));
        const Float density = hn::GatherIndex(
            tag, light.densities, hn::Add(hn::Mul(row, hn::Set(ints, trace::DirectionTable::kAzimuth)), column));
        good = hn::And(good, hn::And(hn::Gt(density.raw, hn::Zero(tag)), hn::Gt(ratio.raw, hn::Zero(tag))));
        const Float cosines = max(dot(along, load3(points.nx, points.ny, points.nz, i)), Float(0.0f)) *
                              max(-dot(along, normal), Float(0.0f));
        const Float q = Float(light.kappa_per_count_pi) * d2 * cosines /
                        max(density * max(facing, Float(0.02f)) * distance * distance, Float(1e-30f));
        const auto material = look(3);
        const auto paint = [&](int word) -> Float {
            return hn::GatherIndex(tag, reinterpret_cast<const float*>(looks.materials.data()) + word,
                                   hn::ShiftLeft<3>(material));
        };
        Vec3 albedo(paint(0), paint(1), paint(2));
        if (!looks.textures.empty()) {
            const auto image = hn::BitCast(ints, paint(3).raw);
            const auto place = [&](int word) -> Float {
                return hn::GatherIndex(tag, reinterpret_cast<const float*>(looks.places.data()) + word,
                                       hn::Mul(triangle, hn::Set(ints, 7)));
            };
            // A ray stands for its neighbours: a quarter of its length wide.
            if (!hn::AllTrue(ints, hn::Eq(image, hn::Set(ints, -1))))
                albedo =
                    textured(looks, image,
                             {place(0) * w + place(2) * u + place(4) * v, place(1) * w + place(3) * u + place(5) * v},
                             distance * Float(0.25f) * place(6), albedo);
        }
        const Float brings = where(good, ratio * cosine / d2 * (q / (Float(1.0f) + q)));
        store3(albedo * brings, out.red, out.green, out.blue, i);
        store3(from, rays.from_x, rays.from_y, rays.from_z, i);
        store3(Vec3() - d, rays.along_x, rays.along_y, rays.along_z, i);
        store(Float(1.0f - 1e-5f), rays.far + i);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::shade
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::shade {

HWY_EXPORT(ShortRays);
HWY_EXPORT(Brings);

namespace {
// Beyond this many times sqrt(kappa · mean area / pi) the share left to rays is below 6 %; what is lost was measured as
// 0.3 % of the light.
constexpr float kReach = 4.0f;
}  // namespace

std::vector<glm::vec3> stratified_directions(unsigned rays, unsigned round) {
    std::vector<glm::vec3> directions;
    const unsigned count = trace::kPacket * rays;
    for (unsigned i = 0; i < count; ++i)
        directions.push_back(
            trace::cosine_hemisphere(trace::scrambled_pair(i + round * count, 0x68bc21ebu, 0x02e5be93u)));
    return directions;
}

float near_reach(const VplCast& vpls, float kappa) {
    return kReach * std::sqrt(kappa * static_cast<float>(vpls.mean_area_m2) / std::numbers::pi_v<float>);
}

void add_near_light(const LightView& light, const Points& points, unsigned active, const Directions& about_z,
                    float kappa, NearSums& sums) {
    if (light.merged != nullptr) return add_merged_near_light(light, points, active, about_z, kappa, sums);
    constexpr float pi = std::numbers::pi_v<float>;
    const float far = near_reach(light.vpls, kappa);
    const NearView view{glm::vec3(light.position),
                        glm::mat3(glm::transpose(light.world_from_light)),
                        light.web,
                        light.rays.table->densities().data(),
                        light.geometry.extent(),
                        kappa / (static_cast<float>(light.vpls.vpls.size()) * pi)};
    trace::RayPacket rays;
    HWY_DYNAMIC_DISPATCH(ShortRays)(points, about_z, view.extent_m, far, rays);
    trace::HitPacket hits;
    if (light.geometry.closest(rays, active, hits) == 0) return;
    NearSums found;
    HWY_DYNAMIC_DISPATCH(Brings)(view, light.looks, hits, points, rays, found);
    unsigned lit = 0;
    for (int i = 0; i < trace::kPacket; ++i)
        lit |= (found.red[i] + found.green[i] + found.blue[i] > 0.0f ? 1u : 0u) << i;
    lit &= active;
    if (lit == 0) return;
    const unsigned seen = lit & ~light.geometry.occluded(rays, lit);
    for (int i = 0; i < trace::kPacket; ++i) {
        if ((seen >> i & 1u) == 0) continue;
        sums.red[i] += found.red[i], sums.green[i] += found.green[i], sums.blue[i] += found.blue[i];
    }
}

NearSums near_light(const LightView& light, const Points& points, unsigned active,
                    const std::vector<glm::vec3>& directions, float kappa) {
    NearSums sums;
    Directions about_z;
    const std::size_t rays = directions.size() / trace::kPacket;
    for (std::size_t r = 0; r < rays; ++r) {
        for (int i = 0; i < trace::kPacket; ++i) about_z.set(i, directions[static_cast<std::size_t>(i) * rays + r]);
        add_near_light(light, points, active, about_z, kappa, sums);
    }
    return sums;
}

}  // namespace gonio::shade
#endif
