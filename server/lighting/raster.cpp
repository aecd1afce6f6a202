#include "server/lighting/raster.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/gtc/packing.hpp>
#include <span>

#include "server/lighting/panes.h"
#include "server/lighting/posed_bodies.h"
#include "server/lighting/screen.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/raster.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef GONIO_LIGHTING_RASTER_STRIP
#define GONIO_LIGHTING_RASTER_STRIP
namespace gonio::lighting {
// A cluster's vertices in homogeneous screen coordinates: pixel = (x / w, y / w), w = distance along the view axis, m;
// and the first and the last pixel centre that may lie on either side of them, all where they are behind the eye.
struct OnScreen {
    static constexpr std::int32_t kEverywhereLow = -(1 << 20), kEverywhereHigh = 1 << 20;
    static constexpr std::size_t kSize = kClusterVertices + kSimdWidth;
    alignas(64) float x[kSize], y[kSize], w[kSize];
    alignas(64) std::int32_t low_x[kSize], high_x[kSize], low_y[kSize], high_y[kSize];
};
inline constexpr int kStripRows = 16;
// One strip of rows, first_row … first_row + rows − 1, of a picture; arrays start at its first row.
struct Strip {
    int first_row, rows;
    std::ptrdiff_t row_length;
    float* depth;
    std::uint32_t* nearest;
    std::uint32_t* normal;
    std::uint32_t* detail;  // null: the scene has no normal maps
    std::uint16_t* albedo;
    float* emission;  // null: not wanted
    RasterSample sample;
};
}  // namespace gonio::lighting
#endif

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_materials.h"

// A cluster's vertices, from its arrays' index `first` on, on the screen. A view's seven numbers.
void Project(const glm::mat3& screen_from_local, const glm::vec3& eye, std::size_t count, const Clusters& clusters,
             std::size_t first, float near_m, OnScreen& out) {
    const Tag tag;
    const IntTag ints;
    const glm::mat3& m = screen_from_local;
    for (std::size_t i = 0; i < count; i += hn::Lanes(tag)) {
        const std::size_t at = first + i;
        const Vec3 p = Vec3(load(clusters.x.data() + at), load(clusters.y.data() + at), load(clusters.z.data() + at)) -
                       Vec3(eye.x, eye.y, eye.z);
        const Float x = dot(p, Vec3(m[0][0], m[1][0], m[2][0])), y = dot(p, Vec3(m[0][1], m[1][1], m[2][1])),
                    w = dot(p, Vec3(m[0][2], m[1][2], m[2][2]));
        store(x, out.x + i), store(y, out.y + i), store(w, out.w + i);
        const Mask ahead = Float(near_m) < w;
        // Far outside the picture any pixel will do. Two roundings of it, and a thousandth of a pixel more.
        const auto pixels = [&](Float across, std::int32_t* low, std::int32_t* high) {
            const Float pixel = min(max(mix(Float(0.0f),
                                            Float(hn::Div(across.raw, hn::Max(w.raw, hn::Set(tag, near_m)))), ahead),
                                        Float(-1e5f)),
                                    Float(1e5f)),
                        slack = Float(1e-3f) + abs(pixel) * Float(2.4e-7f);
            const auto bound = [&](Float value, std::int32_t behind) {
                return hn::IfThenElse(hn::RebindMask(ints, ahead), hn::ConvertTo(ints, value.raw),
                                      hn::Set(ints, behind));
            };
            hn::StoreU(bound(Float(hn::Ceil((pixel - slack).raw)), OnScreen::kEverywhereLow), ints, low + i);
            hn::StoreU(bound(Float(hn::Floor((pixel + slack).raw)), OnScreen::kEverywhereHigh), ints, high + i);
        };
        pixels(x, out.low_x, out.high_x);
        pixels(y, out.low_y, out.high_y);
    }
}

// index: of the setup, kept where it is the nearest. One loop over rows: cut up it would pass twelve locals around.
void RasterTriangle(const MaterialTable& material_table, const Setup& s, std::uint32_t index, const Strip& strip) {
    const Tag tag;
    const IntTag ints;
    const auto simd_lanes = static_cast<int>(hn::Lanes(tag));
    const int low = std::max<int>(s.y0, strip.first_row), high = std::min<int>(s.y1, strip.first_row + strip.rows - 1);
    bool any = false;
    for (int y = low; y <= high; ++y) {
        const auto dy = static_cast<float>(y - s.y0);
        float row[3];
        int x0 = s.x0, x1 = s.x1;
        for (int k = 0; k < 3; ++k) row[k] = s.edge[k][1] * dy + s.edge[k][2];
        if (x1 - x0 > 2 * simd_lanes) {  // where the row enters and leaves, a pixel more on both sides
            float enter = 0.0f, leave = static_cast<float>(x1 - x0);
            for (int k = 0; k < 3; ++k) {
                const float a = s.edge[k][0];
                if (a == 0.0f) {
                    if (row[k] < 0.0f) leave = -2.0f;
                    continue;
                }
                const float at = -row[k] / a;
                if (a > 0.0f)
                    enter = std::max(enter, at - 1.0f);
                else
                    leave = std::min(leave, at + 1.0f);
            }
            if (!(enter <= leave)) continue;
            x1 = s.x0 + static_cast<int>(leave);
            x0 += static_cast<int>(enter);
        }
        const float depth_row = s.depth[1] * dy + s.depth[2];
        float* depth = strip.depth + (y - strip.first_row) * strip.row_length;
        std::uint32_t* nearest = strip.nearest + (y - strip.first_row) * strip.row_length;
        for (int x = x0 / simd_lanes * simd_lanes; x <= x1; x += simd_lanes) {
            const Float dx = hn::ConvertTo(tag, hn::Iota(ints, x - s.x0));
            const Float e0 = Float(s.edge[0][0]) * dx + Float(row[0]), e1 = Float(s.edge[1][0]) * dx + Float(row[1]),
                        e2 = Float(s.edge[2][0]) * dx + Float(row[2]);
            const Float d = Float(s.depth[0]) * dx + Float(depth_row);
            const Float old = load(depth + x);
            Mask shown = hn::And(
                hn::And(hn::Ge(hn::Min(e0.raw, hn::Min(e1.raw, e2.raw)), hn::Zero(tag)), hn::Gt(d.raw, old.raw)),
                hn::Lt(d.raw, hn::Set(tag, 1.0f)));
            if (hn::AllFalse(tag, shown)) continue;
            if ((s.triangle & Setup::kAlphaMask) != 0) {
                HWY_ALIGN float w1[kSimdWidth], w2[kSimdWidth], sum[kSimdWidth], open[kSimdWidth];
                store(e1, w1), store(e2, w2), store(d, sum);
                hn::Store(hn::IfThenElseZero(shown, hn::Set(tag, 1.0f)), tag, open);
                for (int i = 0; i < simd_lanes; ++i) {
                    if (open[i] != 0.0f &&
                        is_hole(material_table, s.triangle & ~Setup::kAlphaMask, w1[i] / sum[i], w2[i] / sum[i],
                                {strip.sample.index, strip.sample.count, s.turn < 0.0f, x + i, y}))
                        open[i] = 0.0f;
                }
                shown = hn::Gt(hn::Load(tag, open), hn::Zero(tag));
            }
            any = true;
            hn::BlendedStore(d.raw, shown, tag, depth + x);
            hn::BlendedStore(hn::Set(ints, static_cast<int>(index) + 1), hn::RebindMask(ints, shown), ints,
                             reinterpret_cast<std::int32_t*>(nearest + x));
        }
    }
    if (any) {  // ShadeStrip will want these
        const std::uint32_t triangle = s.triangle & ~Setup::kAlphaMask;
        hwy::Prefetch(&material_table.triangles[triangle]);
        if (!material_table.uv.empty()) hwy::Prefetch(&material_table.uv[triangle]);
    }
}

// What the nearest triangles look like at `simd_lanes` pixels from x on; strip.nearest becomes that of the scene.
// nearest: of setups, and 1. One: all pixels show the same triangle. Cut up it would pass ten vectors around.
template <bool kOne>
HWY_INLINE void shade_pixels(const MaterialTable& material_table, const Setup* setups, const Strip& strip, int x, int y,
                             hn::Vec<IntTag> nearest, const Rays& rays, float pixel_per_depth) {
    const Tag tag;
    const IntTag ints;
    const auto own = hn::Max(hn::Sub(nearest, hn::Set(ints, 1)), hn::Zero(ints)), setup_at = hn::ShiftLeft<4>(own);
    const auto first_setup = static_cast<std::size_t>(hn::GetLane(own));
    static_assert(sizeof(Setup) == 64 && sizeof(MaterialTable::Triangle) == 16 && sizeof(MaterialTable::Paint) == 32);
    const auto setup = [&](std::size_t word) -> Float {
        const float* base = reinterpret_cast<const float*>(setups) + word;
        return kOne ? hn::Set(tag, base[first_setup * 16]) : hn::GatherIndex(tag, base, setup_at);
    };
    const auto triangle = hn::And(hn::BitCast(ints, setup(15).raw), hn::Set(ints, 0x7fffffff)),
               look_at = hn::ShiftLeft<2>(triangle);
    const auto first = static_cast<std::size_t>(hn::GetLane(triangle));
    const auto look = [&](std::size_t word) {
        const auto* base = reinterpret_cast<const std::int32_t*>(material_table.triangles.data()) + word;
        return kOne ? hn::Set(ints, base[first * 4]) : hn::GatherIndex(ints, base, look_at);
    };
    const Raw corner = setup(13).raw;
    const auto from = hn::BitCast(ints, corner);
    const Float dx = hn::ConvertTo(tag, hn::Sub(hn::Iota(ints, x), hn::ShiftRight<16>(hn::ShiftLeft<16>(from))));
    const Float dy = hn::ConvertTo(tag, hn::Sub(hn::Set(ints, y), hn::ShiftRight<16>(from)));
    const std::ptrdiff_t at = (y - strip.first_row) * strip.row_length + x;
    const Float depth = load(strip.depth + at), per_depth = Float(1.0f) / max(depth, Float(1e-30f));
    const Float w0 = (setup(0) * dx + setup(1) * dy + setup(2)) * per_depth;
    const Float w1 = (setup(3) * dx + setup(4) * dy + setup(5)) * per_depth;
    const Float w2 = Float(1.0f) - w0 - w1;
    Vec3 n = unpack_normal(look(0)) * w0 + unpack_normal(look(1)) * w1 + unpack_normal(look(2)) * w2;
    n = n * (setup(12) * inversesqrt(max(dot(n, n), Float(1e-30f))));
    const auto shown = hn::Gt(nearest, hn::Zero(ints));
    const Mask hit = hn::RebindMask(tag, shown);
    hn::StoreU(hn::IfThenElseZero(shown, hn::Add(triangle, hn::Set(ints, 1))), ints,
               reinterpret_cast<std::int32_t*>(strip.nearest + at));
    hn::StoreU(hn::IfThenElseZero(shown, pack_normal(n)), ints, reinterpret_cast<std::int32_t*>(strip.normal + at));

    Vec3 detail = n;
    const auto material = look(3);
    const auto paint_at = hn::ShiftLeft<3>(material);
    const auto first_paint = static_cast<std::size_t>(hn::GetLane(material));
    const auto paint = [&](std::size_t word) -> Float {
        const float* base = reinterpret_cast<const float*>(material_table.materials.data()) + word;
        return kOne ? hn::Set(tag, base[first_paint * 8]) : hn::GatherIndex(tag, base, paint_at);
    };
    Vec3 albedo(paint(0), paint(1), paint(2)), emission;
    if (!material_table.colors.empty()) {
        static_assert(sizeof(MaterialTable::VertexColors) == 24);
        const auto color_at = hn::Mul(triangle, hn::Set(ints, 6));
        const auto word = [&](std::size_t index) {
            const auto* base = reinterpret_cast<const std::int32_t*>(material_table.colors.data()) + index;
            return kOne ? hn::Set(ints, base[first * 6]) : hn::GatherIndex(ints, base, color_at);
        };
        const auto channel = [&](std::size_t index, bool upper) {
            const auto part = [&](std::size_t corner_index) -> Float {
                const auto bits = word(2 * corner_index + index);
                return hn::ConvertTo(tag, hn::And(upper ? hn::ShiftRight<16>(bits) : bits, hn::Set(ints, 0xffff)));
            };
            return (part(0) * w0 + part(1) * w1 + part(2) * w2) * Float(1.0f / 65535.0f);
        };
        albedo = Vec3(albedo.x * channel(0, false), albedo.y * channel(0, true), albedo.z * channel(1, false));
    }
    if (strip.emission != nullptr) emission = Vec3(paint(4), paint(5), paint(6));
    if (!material_table.textures.empty()) {
        const auto image = hn::BitCast(ints, paint(3).raw), glow = hn::BitCast(ints, paint(7).raw);
        const auto none = hn::Set(ints, -1);
        auto map = none;
        if (strip.detail != nullptr)
            map = hn::GatherIndex(ints, reinterpret_cast<const std::int32_t*>(material_table.normal_maps.data()),
                                  hn::ShiftLeft<1>(material));
        const bool has_image = !hn::AllTrue(ints, hn::Eq(image, none)), has_map = !hn::AllTrue(ints, hn::Eq(map, none)),
                   has_glow = strip.emission != nullptr && !hn::AllTrue(ints, hn::Eq(glow, none));
        if (has_image || has_glow || has_map) {
            const auto uv_at = hn::Mul(triangle, hn::Set(ints, 7));
            static_assert(sizeof(MaterialTable::TriangleUv) == 28);
            const auto part = [&](std::size_t word) -> Float {
                const float* base = reinterpret_cast<const float*>(material_table.uv.data()) + word;
                return kOne ? hn::Set(tag, base[first * 7]) : hn::GatherIndex(tag, base, uv_at);
            };
            const Vec2 uv(part(0) * w0 + part(2) * w1 + part(4) * w2, part(1) * w0 + part(3) * w1 + part(5) * w2);
            // How wide one of n samples of a pixel is on the surface. Of its footprint, a pixel by a pixel over the
            // slope, each has a square 1/n of the area, and is no narrower than they lie apart along the slope.
            const Float column = hn::ConvertTo(tag, hn::Iota(ints, x));
            const glm::vec3 start = rays.corner + static_cast<float>(y) * rays.up;
            const Vec3 ray(Float(start.x) + column * Float(rays.right.x), Float(start.y) + column * Float(rays.right.y),
                           Float(start.z) + column * Float(rays.right.z));
            const Float slope = abs(dot(n, ray)) * inversesqrt(dot(ray, ray)),
                        apart = Float(strip.sample.share) / max(slope, Float(0.02f));
            const Float width = Float(rays.near_m * pixel_per_depth) * per_depth * max(apart, sqrt(apart)) * part(6);
            if (has_image) albedo = textured(material_table, image, uv, width, albedo);
            if (has_map) {
                const auto own_scale =
                    hn::GatherIndex(tag, &material_table.normal_maps.data()->scale, hn::ShiftLeft<1>(material));
                const auto tangent_at = hn::ShiftLeft<2>(triangle);
                const auto word = [&](std::size_t index) {
                    return hn::GatherIndex(
                        ints, reinterpret_cast<const std::int32_t*>(material_table.tangents.data()) + index,
                        tangent_at);
                };
                const Vec3 along =
                    unpack_normal(word(0)) * w0 + unpack_normal(word(1)) * w1 + unpack_normal(word(2)) * w2;
                const Vec3 texel =
                    textured(material_table, map, uv, width, Vec3(Float(1.0f), Float(1.0f), Float(1.0f)));
                const Vec3 mapped =
                    mapped_normal(n * setup(12), along, Float(hn::BitCast(tag, word(3))), own_scale, texel);
                const Mask has = hn::RebindMask(tag, hn::Gt(map, none));
                detail = Vec3(mix(n.x, mapped.x * setup(12), has), mix(n.y, mapped.y * setup(12), has),
                              mix(n.z, mapped.z * setup(12), has));
            }
            if (has_glow) emission = textured(material_table, glow, uv, width, emission);
        }
    }
    if (strip.emission != nullptr && !material_table.dark_backs.empty()) {
        const auto dark = hn::GatherIndex(ints, material_table.dark_backs.data(), material);
        const Mask off = hn::And(hn::RebindMask(tag, hn::Gt(dark, hn::Zero(ints))), setup(12) < Float(0.0f));
        emission = Vec3(mix(emission.x, Float(), off), mix(emission.y, Float(), off), mix(emission.z, Float(), off));
    }
    if (strip.detail != nullptr)
        hn::StoreU(hn::IfThenElseZero(shown, pack_normal(detail)), ints,
                   reinterpret_cast<std::int32_t*>(strip.detail + at));
    const hn::Rebind<hwy::float16_t, Tag> halves;
    const hn::RebindToUnsigned<decltype(halves)> half_bits;
    const auto half = [&](Float value) {
        return hn::BitCast(half_bits, hn::DemoteTo(halves, hn::IfThenElseZero(hit, value.raw)));
    };
    hn::StoreInterleaved4(half(albedo.x), half(albedo.y), half(albedo.z), half(Float(1.0f)), half_bits,
                          strip.albedo + 4 * at);
    if (strip.emission != nullptr)
        hn::StoreInterleaved4(hn::IfThenElseZero(hit, emission.x.raw), hn::IfThenElseZero(hit, emission.y.raw),
                              hn::IfThenElseZero(hit, emission.z.raw), hn::Set(tag, 1.0f), tag,
                              strip.emission + 4 * at);
}

void ShadeStrip(const MaterialTable& material_table, const Setup* setups, const Strip& strip, const Rays& rays,
                float pixel_per_depth) {
    const Tag tag;
    const IntTag ints;
    const auto simd_lanes = static_cast<int>(hn::Lanes(tag));
    for (int y = strip.first_row; y < strip.first_row + strip.rows; ++y) {
        const std::uint32_t* nearest = strip.nearest + (y - strip.first_row) * strip.row_length;
        for (int x = 0; x < static_cast<int>(strip.row_length); x += simd_lanes) {
            const auto which = hn::LoadU(ints, reinterpret_cast<const std::int32_t*>(nearest + x));
            if (hn::AllTrue(ints, hn::Eq(which, hn::Set(ints, static_cast<int>(nearest[x])))))
                shade_pixels<true>(material_table, setups, strip, x, y, which, rays, pixel_per_depth);
            else
                shade_pixels<false>(material_table, setups, strip, x, y, which, rays, pixel_per_depth);
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(Project);
HWY_EXPORT(RasterTriangle);
HWY_EXPORT(ShadeStrip);

namespace {

// The picture's sides as planes through the eye, pointing in.
struct Frustum {
    glm::vec3 eye;
    glm::vec3 planes[4];

    Frustum(const Rays& rays, int width, int height) : eye(rays.eye) {
        const auto corner = [&](float x, float y) { return rays.corner + x * rays.right + y * rays.up; };
        const float right = static_cast<float>(width) - 0.5f, top = static_cast<float>(height) - 0.5f;
        const glm::vec3 at[4] = {corner(-0.5f, -0.5f), corner(right, -0.5f), corner(right, top), corner(-0.5f, top)};
        const glm::vec3 inside = corner(0.5f * right, 0.5f * top);
        for (int i = 0; i < 4; ++i) {
            glm::vec3 n = glm::normalize(glm::cross(at[i], at[(i + 1) % 4]));
            planes[i] = glm::dot(n, inside) < 0.0f ? -n : n;
        }
    }
    // Whether a cluster may be seen: it is inside, and not all of it faces away.
    bool shows(const Cluster& cluster) const {
        const glm::vec3 to = cluster.centre - eye;
        for (const glm::vec3& plane : planes) {
            if (glm::dot(plane, to) < -cluster.radius) return false;
        }
        return !cluster.one_sided ||
               glm::dot(to, cluster.axis) < cluster.cone_cutoff * glm::length(to) + cluster.radius;
    }
};

// A triangle of a cluster -> its setup. Result: whether it covers the centre of a pixel, perhaps. Its seven parameters
// are a triangle's and the picture's.
bool set_up(const OnScreen& screen, const std::array<std::uint8_t, 3>& corner, bool one_sided, int width, int height,
            double near_m, Setup& setup) {
    const auto [a, b, c] = corner;
    const int left = std::max(0, std::min({screen.low_x[a], screen.low_x[b], screen.low_x[c]})),
              right = std::min(width - 1, std::max({screen.high_x[a], screen.high_x[b], screen.high_x[c]})),
              bottom = std::max(0, std::min({screen.low_y[a], screen.low_y[b], screen.low_y[c]})),
              top = std::min(height - 1, std::max({screen.high_y[a], screen.high_y[b], screen.high_y[c]}));
    if (left > right || bottom > top) return false;
    glm::dvec3 v[3];
    for (std::size_t k = 0; k < 3; ++k)
        v[k] = glm::dvec3(glm::vec3(screen.x[corner[k]], screen.y[corner[k]], screen.w[corner[k]]));
    // All corners behind the eye, or beyond one side of the picture.
    const auto all = [&](auto beyond) { return beyond(v[0]) && beyond(v[1]) && beyond(v[2]); };
    if (all([&](const glm::dvec3& p) { return p.z <= near_m; }) || all([](const glm::dvec3& p) { return p.x < 0.0; }) ||
        all([](const glm::dvec3& p) { return p.y < 0.0; }) ||
        all([&](const glm::dvec3& p) { return p.x > (width - 1) * p.z; }) ||
        all([&](const glm::dvec3& p) { return p.y > (height - 1) * p.z; }))
        return false;
    const double x0 = left, y0 = bottom, x1 = right, y1 = top;
    glm::dvec3 edge[3] = {glm::cross(v[1], v[2]), glm::cross(v[2], v[0]), glm::cross(v[0], v[1])};
    const double volume = glm::dot(v[0], edge[0]);  // > 0: counter-clockwise on the screen, y up
    // Seen edge-on its sign and its depth would be rounding alone: corners are known to 6e-8 of themselves.
    const double scale = std::abs(v[0].x * edge[0].x) + std::abs(v[0].y * edge[0].y) + std::abs(v[0].z * edge[0].z);
    if (!(std::abs(volume) > 4e-7 * scale) || (one_sided && volume < 0.0)) return false;
    setup.turn = volume < 0.0 ? -1.0f : 1.0f;
    setup.x0 = static_cast<std::int16_t>(x0), setup.y0 = static_cast<std::int16_t>(y0);
    setup.x1 = static_cast<std::int16_t>(x1), setup.y1 = static_cast<std::int16_t>(y1);
    glm::dvec3 sum(0.0);
    for (int k = 0; k < 3; ++k) {
        edge[k] *= near_m / volume;
        edge[k].z += edge[k].x * x0 + edge[k].y * y0;
        sum += edge[k];
        // Rounding must not open cracks between neighbours: an edge is let out by what single precision may lose.
        const double slack = 5e-7 * (std::abs(edge[k].x) * (x1 - x0 + 1.0) + std::abs(edge[k].y) * (y1 - y0 + 1.0));
        setup.edge[k][0] = static_cast<float>(edge[k].x), setup.edge[k][1] = static_cast<float>(edge[k].y);
        setup.edge[k][2] = static_cast<float>(edge[k].z + slack);
    }
    for (int k = 0; k < 3; ++k) setup.depth[k] = static_cast<float>(sum[k]);
    return true;
}

// What lies before the nearest surfaces of a strip's pixels, and is seen through, tints them.
struct Tints {
    static constexpr float kSame = 2e-6f;  // depths that differ less are one
    std::vector<glm::vec3> tint;           // by pixel; empty: none
    std::vector<float> depth;              // of the last one: two triangles that meet there count once

    void take(const MaterialTable& material_table, const Setup& s, const Strip& strip) {
        const std::uint32_t triangle = s.triangle & ~Setup::kAlphaMask;
        const auto count = static_cast<std::size_t>(strip.rows * strip.row_length);
        const int low = std::max<int>(s.y0, strip.first_row),
                  high = std::min<int>(s.y1, strip.first_row + strip.rows - 1);
        for (int y = low; y <= high; ++y) {
            for (int x = s.x0; x <= s.x1; ++x) {
                const auto dx = static_cast<float>(x - s.x0), dy = static_cast<float>(y - s.y0);
                const auto at = [&](const float* plane) { return plane[0] * dx + plane[1] * dy + plane[2]; };
                const float e[3] = {at(s.edge[0]), at(s.edge[1]), at(s.edge[2])}, d = at(s.depth);
                const auto pixel = static_cast<std::size_t>((y - strip.first_row) * strip.row_length + x);
                if (!(std::min({e[0], e[1], e[2]}) >= 0.0f && d > strip.depth[pixel] * (1.0f + kSame) && d < 1.0f))
                    continue;
                if (strip.nearest[pixel] == triangle + 1) continue;  // it is what the pixel shows
                const auto pane = transparency_at(material_table, triangle, e[1] / d, e[2] / d);
                if (!pane || pane->tint == glm::vec3(1.0f)) continue;
                if (tint.empty()) tint.assign(count, glm::vec3(1.0f)), depth.assign(count, 0.0f);
                if (std::abs(depth[pixel] - d) <= kSame * d) continue;
                depth[pixel] = d;
                tint[pixel] *= pane->tint;
            }
        }
    }
    // To the strip's colours.
    void give(const Strip& strip) const {
        for (std::size_t pixel = 0; pixel < tint.size(); ++pixel) {
            for (std::size_t k = 0; k < 3; ++k) {
                std::uint16_t& albedo = strip.albedo[4 * pixel + k];
                albedo = glm::packHalf1x16(glm::unpackHalf1x16(albedo) * tint[pixel][static_cast<int>(k)]);
                if (strip.emission != nullptr) strip.emission[4 * pixel + k] *= tint[pixel][static_cast<int>(k)];
            }
        }
    }
};

constexpr std::size_t kClustersPerChunk = 32;

std::size_t chunks_of(const Clusters& clusters) {
    return (clusters.clusters.size() + kClustersPerChunk - 1) / kClustersPerChunk;
}
std::size_t strips_of(const GBuffer& gbuffer) {
    return static_cast<std::size_t>((gbuffer.height + kStripRows - 1) / kStripRows);
}

// Sets up the triangles that meet the picture. Result: clusters that do.
unsigned set_up_all(const Clusters& clusters, std::size_t triangles, const GBuffer& gbuffer, SetUp& out, Pool& pool) {
    const Rays& rays = gbuffer.rays;
    const int width = gbuffer.width, height = gbuffer.height;
    if (const std::size_t wanted = triangles + 1; out.capacity < wanted || out.capacity > 2 * wanted)
        out.setups = std::make_unique_for_overwrite<Setup[]>(out.capacity = wanted);
    out.setups[0] = {};  // which pixels without a surface look at
    const std::size_t strips = strips_of(gbuffer);
    out.bins.resize(chunks_of(clusters) * strips);
    const Frustum frustum(rays, width, height);
    const glm::mat3 screen_from_local = glm::mat3(glm::inverse(glm::dmat3(rays.right, rays.up, rays.corner)));
    const auto set_up_some = [&](std::size_t first, std::size_t count) {
        unsigned drawn = 0;
        std::vector<std::uint32_t>* bins = &out.bins[first / kClustersPerChunk * strips];
        for (std::size_t s = 0; s < strips; ++s) bins[s].clear();
        OnScreen screen;
        std::uint32_t index = clusters.clusters[first].first_triangle;
        for (const Cluster& cluster : std::span(clusters.clusters).subspan(first, count)) {
            if (!frustum.shows(cluster)) continue;
            ++drawn;
            HWY_DYNAMIC_DISPATCH(Project)
            (screen_from_local, rays.eye, cluster.vertices, clusters, cluster.first_vertex, rays.near_m, screen);
            for (std::uint32_t t = cluster.first_triangle; t < cluster.first_triangle + cluster.triangles; ++t) {
                const auto& [corner, look] = clusters.triangles[t];
                Setup& setup = out.setups[index];
                if (!set_up(screen, corner, cluster.one_sided, width, height, static_cast<double>(rays.near_m), setup))
                    continue;
                setup.triangle = look | (cluster.alpha_mask ? Setup::kAlphaMask : 0u);
                const int last = setup.y1 / kStripRows;
                for (int s = setup.y0 / kStripRows; s <= last; ++s) bins[s].push_back(index);
                ++index;
            }
        }
        return drawn;
    };
    return pool.reduce_chunks(clusters.clusters.size(), kClustersPerChunk, 0u, set_up_some, std::plus<>());
}

// The nearest of a strip's triangles, and what they look like. Chunk by chunk: of two triangles at the same depth the
// first stays, whatever thread set them up. Six parameters: a scene's and a strip's.
void draw_strip(const SetUp& triangles, std::size_t strips, std::size_t which, const MaterialTable& material_table,
                const GBuffer& gbuffer, const Strip& strip) {
    for (std::size_t bin = which; bin < triangles.bins.size(); bin += strips) {
        for (const std::uint32_t index : triangles.bins[bin])
            HWY_DYNAMIC_DISPATCH(RasterTriangle)(material_table, triangles.setups[index], index, strip);
    }
    // Whole vectors were drawn: nothing is beyond the picture.
    for (std::ptrdiff_t y = 0; y < strip.rows; ++y) {
        std::fill(strip.depth + y * strip.row_length + gbuffer.width, strip.depth + (y + 1) * strip.row_length, 0.0f);
        std::fill(strip.nearest + y * strip.row_length + gbuffer.width, strip.nearest + (y + 1) * strip.row_length, 0u);
    }
    HWY_DYNAMIC_DISPATCH(ShadeStrip)
    (material_table, triangles.setups.get(), strip, gbuffer.rays, gbuffer.depth_per_pixel);
}

// Bodies over what a strip shows. first_triangle: what theirs are counted from. Seven parameters: as of draw_strip.
void draw_over(const PosedBodies& bodies, std::uint32_t first_triangle, const SetUp& triangles, std::size_t strips,
               std::size_t which, const GBuffer& gbuffer, const Strip& strip) {
    bool any = false;
    for (std::size_t bin = which; bin < triangles.bins.size(); bin += strips) any |= !triangles.bins[bin].empty();
    if (!any) return;
    static thread_local std::vector<float> depth;
    static thread_local std::vector<std::uint32_t> nearest, normal;
    static thread_local std::vector<std::uint16_t> albedo;
    const auto count = static_cast<std::size_t>(strip.rows * strip.row_length);
    depth.assign(strip.depth, strip.depth + count);
    nearest.assign(count, 0u);
    normal.resize(count);
    albedo.resize(4 * count);
    Strip own = strip;
    own.depth = depth.data(), own.nearest = nearest.data(), own.normal = normal.data(), own.albedo = albedo.data();
    own.detail = nullptr, own.emission = nullptr;
    draw_strip(triangles, strips, which, bodies.material_table(), gbuffer, own);
    for (std::size_t i = 0; i < count; ++i) {
        if (nearest[i] == 0) continue;
        strip.depth[i] = depth[i];
        strip.nearest[i] = first_triangle + nearest[i];
        strip.normal[i] = normal[i];
        if (strip.detail != nullptr) strip.detail[i] = normal[i];
        std::copy_n(albedo.data() + 4 * i, 4, strip.albedo + 4 * i);
        if (strip.emission != nullptr) std::fill_n(strip.emission + 4 * i, 4, 0.0f);
    }
}

}  // namespace

unsigned draw_gbuffer(const Clusters& clusters, const MaterialTable& material_table, bool emissive, GBuffer& gbuffer,
                      Raster& raster, Pool& pool, const RasterSample& sample, const PosedBodies* bodies) {
    const std::size_t pixels = gbuffer.row_length * static_cast<std::size_t>(gbuffer.height);
    gbuffer.depth.resize(pixels);
    gbuffer.normal.resize(pixels);
    gbuffer.detail.resize(material_table.tangents.empty() ? 0 : pixels);
    raster.nearest.resize(pixels);
    raster.albedo.resize(4 * pixels);
    if (emissive) raster.emission.resize(4 * pixels);
    const bool panes = any_pane(material_table);
    const auto first_body = static_cast<std::uint32_t>(material_table.triangles.size());
    unsigned drawn = set_up_all(clusters, material_table.triangles.size(), gbuffer, raster, pool);
    if (bodies != nullptr)
        drawn +=
            set_up_all(bodies->clusters(), bodies->material_table().triangles.size(), gbuffer, raster.bodies, pool);
    const std::size_t strips = strips_of(gbuffer);
    pool.run(static_cast<int>(strips), [&](int job) {
        const int first_row = job * kStripRows;
        const auto row_length = static_cast<std::ptrdiff_t>(gbuffer.row_length), at = first_row * row_length;
        const Strip strip{first_row,
                          std::min(kStripRows, gbuffer.height - first_row),
                          row_length,
                          gbuffer.depth.data() + at,
                          raster.nearest.data() + at,
                          gbuffer.normal.data() + at,
                          gbuffer.detail.empty() ? nullptr : gbuffer.detail.data() + at,
                          raster.albedo.data() + 4 * at,
                          emissive ? raster.emission.data() + 4 * at : nullptr,
                          sample};
        const auto count = static_cast<std::size_t>(strip.rows * strip.row_length);
        const auto which = static_cast<std::size_t>(job);
        std::fill_n(strip.depth, count, 0.0f);
        std::fill_n(strip.nearest, count, 0u);
        draw_strip(raster, strips, which, material_table, gbuffer, strip);
        if (panes) {
            Tints tints;
            for (std::size_t bin = which; bin < raster.bins.size(); bin += strips) {
                for (const std::uint32_t place : raster.bins[bin]) {
                    if ((raster.setups[place].triangle & Setup::kAlphaMask) != 0)
                        tints.take(material_table, raster.setups[place], strip);
                }
            }
            tints.give(strip);
        }
        if (bodies != nullptr) draw_over(*bodies, first_body, raster.bodies, strips, which, gbuffer, strip);
    });
    return drawn;
}

}  // namespace gonio::lighting
#endif
