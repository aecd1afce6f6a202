#include "server/lighting/screen.h"

#include <algorithm>
#include <cmath>

#include "server/lighting/layers.h"
#include "server/lighting/material_table.h"
#include "server/lighting/packed_normal.h"
#include "shaders/lib/as_cpp.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/screen.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef GONIO_LIGHTING_UPSAMPLE_NEAR
#define GONIO_LIGHTING_UPSAMPLE_NEAR
namespace gonio::lighting {
// Distance off a plane that is still near when values are brought to finer points, in steps of their grid.
inline constexpr float kUpsampleNear = 2.0f;
}  // namespace gonio::lighting
#endif

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_layers.h"
#include "server/lighting/simd_materials.h"
#include "server/lighting/simd_pixels.h"

// Fills in the weights of row y and where they are poor.
void WeightsRow(const GBuffer& gbuffer, int y, ScreenGrid& screen) {
    // Points alike by less are poor, and by less than the second none.
    constexpr float kPoorWeight = 0.2f, kLeastWeight = 0.02f;
    const Rays& rays = gbuffer.rays;
    const Points grid = points_at(screen.grid.values, static_cast<std::size_t>(screen.grid.at(0, 0)));
    const float near_per_depth = kUpsampleNear * screen.depth_per_point;
    const auto width = static_cast<std::ptrdiff_t>(gbuffer.row_length), row = y * width;
    const Tag tag;
    const IntTag ints;
    const auto simd_lanes = static_cast<std::ptrdiff_t>(hn::Lanes(tag));
    const std::ptrdiff_t low = row_below(y);
    const float along_y = static_cast<float>(y - 2) * 0.25f - static_cast<float>(low);
    const glm::vec3 start = rays.corner + static_cast<float>(y) * rays.up;
    for (std::ptrdiff_t x = 0; x < width; x += 4 * simd_lanes) {
        Raw d[4];
        hn::LoadInterleaved4(tag, gbuffer.depth.data() + row + x, d[0], d[1], d[2], d[3]);
        hn::Vec<IntTag> packed[4];
        hn::LoadInterleaved4(ints, reinterpret_cast<const std::int32_t*>(gbuffer.normal.data()) + row + x, packed[0],
                             packed[1], packed[2], packed[3]);
        hn::Vec<IntTag> result[4], poorly = hn::Zero(ints);
        for (int phase = 0; phase < 4; ++phase) {
            // The pixel's surface.
            const Float z = Float(rays.near_m) / max(Float(d[phase]), Float(1e-30f));
            const Vec3 p = surface_point(rays, start, column_of(x + phase), z), n = unpack_normal(packed[phase]);
            const Float per_near = Float(1.0f) / max(z * Float(near_per_depth), Float(1e-30f));
            const std::ptrdiff_t left = x / 4 + left_of(phase);
            const float along_x =
                phase < 2 ? 0.5f + 0.25f * static_cast<float>(phase) : 0.25f * static_cast<float>(phase - 2);
            Float sum, weight[4];
            for (int corner = 0; corner < 4; ++corner) {
                const std::ptrdiff_t at = (low + corner / 2) * screen.grid.stride + left + corner % 2;
                const float bilinear =
                    (corner % 2 == 0 ? 1.0f - along_x : along_x) * (corner / 2 == 0 ? 1.0f - along_y : along_y) + 1e-3f;
                const Float off = dot(n, position_of(grid, at) - p) * per_near;
                weight[corner] = edge_stopping_weight(dot(n, normal_of(grid, at)), off) * Float(bilinear);
                sum = sum + weight[corner];
            }
            const Mask shown = hn::Gt(d[phase], hn::Zero(tag)), good = hn::Ge(sum.raw, hn::Set(tag, kPoorWeight)),
                       any = hn::Ge(sum.raw, hn::Set(tag, kLeastWeight));
            poorly =
                hn::Add(poorly, hn::IfThenElseZero(hn::RebindMask(ints, hn::AndNot(good, shown)), hn::Set(ints, 1)));
            const Float scale = hn::IfThenElseZero(
                hn::And(any, shown), (mix(Float(127.0f), Float(255.0f), good) / max(sum, Float(kLeastWeight))).raw);
            const auto byte = [&](int corner) { return hn::NearestInt((weight[corner] * scale).raw); };
            result[phase] = hn::Or(hn::Or(byte(0), hn::ShiftLeft<8>(byte(1))),
                                   hn::Or(hn::ShiftLeft<16>(byte(2)), hn::ShiftLeft<24>(byte(3))));
        }
        hn::StoreInterleaved4(result[0], result[1], result[2], result[3], ints,
                              reinterpret_cast<std::int32_t*>(screen.to_pixels.weights.data()) + row + x);
        const hn::Rebind<std::uint8_t, Tag> bytes;
        hn::StoreU(hn::DemoteTo(bytes, poorly), bytes, screen.to_pixels.poor.data() + (row + x) / 4);
    }
}

// light: 3 planes in the shape of the grid. out: 4 half floats per pixel of row y.
void UpsampleRow(const GBuffer& gbuffer, const ScreenGrid& screen, const Planes& light, int y, std::uint16_t* out) {
    const Tag tag;
    const IntTag ints;
    const auto simd_lanes = static_cast<std::ptrdiff_t>(hn::Lanes(tag));
    const auto width = static_cast<std::ptrdiff_t>(gbuffer.row_length), stride = screen.grid.stride;
    const std::uint32_t* weights = screen.to_pixels.weights.data() + y * width;
    const float* values[3];
    for (std::size_t k = 0; k < 3; ++k) values[k] = light[k].data() + screen.grid.at(0, row_below(y));
    HWY_ALIGN float plane[3][4 * kSimdWidth];
    for (std::ptrdiff_t x = 0; x < width; x += 4 * simd_lanes) {
        hn::Vec<IntTag> packed[4];
        hn::LoadInterleaved4(ints, reinterpret_cast<const std::int32_t*>(weights) + x, packed[0], packed[1], packed[2],
                             packed[3]);
        Raw result[3][4];
        for (int phase = 0; phase < 4; ++phase) {
            const auto byte = [&](hn::Vec<IntTag> bits) -> Float {
                return hn::ConvertTo(tag, hn::And(bits, hn::Set(ints, 255)));
            };
            const Float weight[4] = {byte(packed[phase]), byte(hn::ShiftRight<8>(packed[phase])),
                                     byte(hn::ShiftRight<16>(packed[phase])), byte(hn::ShiftRight<24>(packed[phase]))};
            const Float per_sum = Float(1.0f) / max(weight[0] + weight[1] + weight[2] + weight[3], Float(1.0f));
            for (int k = 0; k < 3; ++k) {
                const float* value = values[k] + x / 4 + left_of(phase);
                const Float sum = weight[0] * load(value) + weight[1] * load(value + 1) +
                                  weight[2] * load(value + stride) + weight[3] * load(value + stride + 1);
                result[k][phase] = (sum * per_sum).raw;
            }
        }
        for (int k = 0; k < 3; ++k)
            hn::StoreInterleaved4(result[k][0], result[k][1], result[k][2], result[k][3], tag, plane[k]);
        for (std::ptrdiff_t i = 0; i < 4 * simd_lanes; i += simd_lanes)
            store_rgb({load(plane[0] + i), load(plane[1] + i), load(plane[2] + i)}, out + 4 * (x + i));
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(WeightsRow);
HWY_EXPORT(UpsampleRow);

void Grid::resize(int new_width, int new_height, std::size_t new_spare) {
    width = new_width;
    height = new_height;
    spare = (new_spare + kSimdWidth - 1) / kSimdWidth * kSimdWidth;
    // Rows end in a border and the widest vector that starts at the last value.
    stride = (width + 2 * kBorder + static_cast<std::ptrdiff_t>(kSimdWidth) + 15) / 16 * 16;
    for (std::vector<float>& array : values) array.assign(size() + kSimdWidth, 0.0f);
}

void Grid::set(std::size_t at, const glm::vec3& position, const glm::vec3& normal, float depth) {
    for (int k = 0; k < 3; ++k) {
        values[k][at] = position[k];
        values[k + 3][at] = normal[k];
    }
    values[6][at] = depth;
}

void Grid::extend(std::vector<float>& plane) const {
    for (int y = 0; y < height; ++y) {
        for (int b = 1; b <= kBorder; ++b) {
            plane[static_cast<std::size_t>(at(-b, y))] = plane[static_cast<std::size_t>(at(0, y))];
            plane[static_cast<std::size_t>(at(width - 1 + b, y))] = plane[static_cast<std::size_t>(at(width - 1, y))];
        }
    }
    for (int b = 1; b <= kBorder; ++b) {
        std::copy_n(plane.begin() + at(-kBorder, 0), stride, plane.begin() + at(-kBorder, -b));
        std::copy_n(plane.begin() + at(-kBorder, height - 1), stride, plane.begin() + at(-kBorder, height - 1 + b));
    }
}

void look_through(const Eye& eye, const trace::Geometry& geometry, float near_m, int width, int height, GBuffer& s) {
    s.width = width;
    s.height = height;
    constexpr std::size_t kRow = 4 * kSimdWidth;
    s.row_length = (static_cast<std::size_t>(width) + kRow - 1) / kRow * kRow;
    s.depth.resize(s.row_length * static_cast<std::size_t>(height));
    s.normal.resize(s.depth.size());
    const glm::dvec3 x = eye.right * eye.tan_half_x, y = eye.up * eye.tan_half_y;
    const glm::dvec3 right = x * (2.0 * eye.window_half.x / width), up = y * (2.0 * eye.window_half.y / height);
    s.rays.eye = geometry.local(eye.position);
    s.rays.right = glm::vec3(right);
    s.rays.up = glm::vec3(up);
    s.rays.corner = glm::vec3(eye.forward + x * (eye.window_centre.x - eye.window_half.x) +
                              y * (eye.window_centre.y - eye.window_half.y) + 0.5 * (right + up));
    s.rays.near_m = near_m;
    s.depth_per_pixel = static_cast<float>(glm::length(up));
}

Spot spot_at(const GBuffer& s, int x, int y) {
    const std::size_t at = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x);
    Spot spot;
    if (!(s.depth[at] > 0.0f)) return spot;
    spot.depth = s.rays.near_m / s.depth[at];
    spot.position =
        s.rays.eye +
        (s.rays.corner + static_cast<float>(x) * s.rays.right + static_cast<float>(y) * s.rays.up) * spot.depth;
    spot.normal = unpack_normal(s.normal[at]);
    return spot;
}

glm::vec3 lit_normal_at(const GBuffer& s, int x, int y) {
    const std::size_t at = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x);
    return unpack_normal(s.detail.empty() ? s.normal[at] : s.detail[at]);
}

namespace {

std::size_t row_of(const GBuffer& gbuffer, int y) {
    return static_cast<std::size_t>(y) * gbuffer.row_length;
}

// Result: of the sixteen points around a pixel the one most like its surface, else the nearest that shows one; 0: none.
std::size_t best_point(const Grid& grid, int x, int y, const Spot& spot, float near_per_depth) {
    float best = 0.0f;
    std::size_t from = 0;
    for (int k = 0; k < 16; ++k) {
        const auto at = static_cast<std::size_t>(grid.at(std::clamp((x + 2) / 4 - 2 + k % 4, 0, grid.width - 1),
                                                         std::clamp((y + 2) / 4 - 2 + k / 4, 0, grid.height - 1)));
        if (!(grid.values[6][at] > 0.0f)) continue;
        const glm::vec3 to = grid.position(at) - spot.position;
        const float weight = glsl::edge_stopping_weight(glm::dot(spot.normal, grid.normal(at)),
                                                        glm::dot(spot.normal, to) / (spot.depth * near_per_depth)) +
                             1e-4f / (1.0f + glm::dot(to, to) / (spot.depth * spot.depth));
        if (weight > best) best = weight, from = at;
    }
    return from;
}

// Whether the four points around a pixel of a surface are poorly like it.
bool is_poor(std::uint32_t weights) {
    return (weights & 255u) + (weights >> 8 & 255u) + (weights >> 16 & 255u) + (weights >> 24) < kPoorSum;
}

// Fills in what pixels with poor weights take after rather than these: a point of their own. There are as many such
// points as there is room for outside the grid's rows, at most so many. Pixels without one and without any weights take
// the most alike of sixteen points around.
void take_after(const GBuffer& gbuffer, std::size_t most, ScreenGrid& screen, Pool& pool) {
    ToPixels& to = screen.to_pixels;
    const auto height = static_cast<std::size_t>(gbuffer.height);
    to.odd.resize(height);
    pool.run(gbuffer.height, [&](int y) {
        std::vector<ToPixels::Odd>& odd = to.odd[static_cast<std::size_t>(y)];
        odd.clear();
        const std::size_t row = row_of(gbuffer, y);
        for (std::size_t x = 0; x < static_cast<std::size_t>(gbuffer.width); ++x) {
            if (to.poor[(row + x) / 4] == 0)
                x |= 3;
            else if (is_poor(to.weights[row + x]) && gbuffer.depth[row + x] > 0.0f)
                odd.push_back({static_cast<std::uint32_t>(x), 0});
        }
    });
    std::vector<std::size_t> before{0};  // row y: of such pixels
    for (const auto& odd : to.odd) before.push_back(before.back() + odd.size());
    const std::size_t wanted = before.back(), own = std::min({wanted, most, screen.grid.spare});
    screen.own_pixels.resize(own);
    pool.run(gbuffer.height, [&](int y) {
        std::vector<ToPixels::Odd>& odd = to.odd[static_cast<std::size_t>(y)];
        std::size_t kept = 0;
        for (std::size_t i = 0; i < odd.size(); ++i) {
            ToPixels::Odd pixel = odd[i];
            const std::size_t at = row_of(gbuffer, y) + pixel.x, nth = before[static_cast<std::size_t>(y)] + i,
                              point = nth * own / wanted;
            const Spot spot = spot_at(gbuffer, static_cast<int>(pixel.x), y);
            if ((nth + 1) * own / wanted > point) {  // so many of those that want one, evenly
                pixel.from = static_cast<std::uint32_t>(screen.grid.first_spare() + point);
                screen.own_pixels[point] = static_cast<std::uint32_t>(at);
                screen.grid.set(pixel.from, spot.position, spot.normal, spot.depth);
            } else if (to.weights[at] == 0) {
                pixel.from = static_cast<std::uint32_t>(best_point(screen.grid, static_cast<int>(pixel.x), y, spot,
                                                                   kUpsampleNear * screen.depth_per_point));
            }
            if (pixel.from != 0) odd[kept++] = pixel;
        }
        odd.resize(kept);
    });
}

}  // namespace

void make_grid(const GBuffer& gbuffer, bool own_points, ScreenGrid& screen, Pool& pool) {
    screen.depth_per_point = gbuffer.depth_per_pixel * static_cast<float>(kStep);
    Grid& grid = screen.grid;
    const int width = (gbuffer.width + kStep - 1) / kStep, height = (gbuffer.height + kStep - 1) / kStep;
    // Layers keep their shape as quality levels change.
    const std::size_t spare = static_cast<std::size_t>(width * height) * kStep * kStep / kOwnPoints;
    grid.resize(width, height, spare);
    pool.run(grid.height, [&](int y) {
        for (int x = 0; x < grid.width; ++x) {
            const Spot spot = spot_at(gbuffer, std::min(x * kStep + kStep / 2, gbuffer.width - 1),
                                      std::min(y * kStep + kStep / 2, gbuffer.height - 1));
            grid.set(static_cast<std::size_t>(grid.at(x, y)), spot.position, spot.normal, spot.depth);
        }
    });
    for (std::vector<float>& array : grid.values) grid.extend(array);

    screen.to_pixels.weights.resize(row_of(gbuffer, gbuffer.height));
    screen.to_pixels.poor.resize(screen.to_pixels.weights.size() / 4);
    pool.run(gbuffer.height, [&](int y) { HWY_DYNAMIC_DISPATCH(WeightsRow)(gbuffer, y, screen); });
    take_after(gbuffer, own_points ? spare : 0, screen, pool);
}

void upsample_line(const GBuffer& gbuffer, const ScreenGrid& screen, const Planes& light, int y, std::uint16_t* out) {
    HWY_DYNAMIC_DISPATCH(UpsampleRow)(gbuffer, screen, light, y, out);
    const std::vector<ToPixels::Odd>& odd = screen.to_pixels.odd[static_cast<std::size_t>(y)];
    static thread_local std::vector<float> own;  // 4 for each pixel of `odd`
    static thread_local std::vector<std::uint16_t> halves;
    own.resize((4 * odd.size() + kSimdWidth - 1) / kSimdWidth * kSimdWidth);
    halves.resize(own.size());
    for (std::size_t i = 0; i < odd.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) own[4 * i + k] = light[k][odd[i].from];
    }
    to_halves(own.data(), own.size(), halves.data());
    for (std::size_t i = 0; i < odd.size(); ++i) std::copy_n(halves.data() + 4 * i, 3, out + 4 * odd[i].x);
}

void upsample(const GBuffer& gbuffer, const ScreenGrid& screen, const Planes& light, std::vector<std::uint16_t>& out,
              Pool& pool) {
    out.resize(row_of(gbuffer, gbuffer.height) * 4);
    pool.run(gbuffer.height,
             [&](int y) { upsample_line(gbuffer, screen, light, y, out.data() + 4 * row_of(gbuffer, y)); });
}

}  // namespace gonio::lighting
#endif
