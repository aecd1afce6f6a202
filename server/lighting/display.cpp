#include "server/lighting/display.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "server/lighting/antialias.h"
#include "server/lighting/opening_pixels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/display.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// After the two above: once for each instruction set.
#include <hwy/contrib/math/math-inl.h>

// The tone curve as a table over the bits of its argument, defined once for all instruction sets.
#ifndef GONIO_LIGHTING_TONE_TABLE
#define GONIO_LIGHTING_TONE_TABLE
#include "shaders/lib/as_cpp.h"
namespace gonio::lighting {
// 256 values per octave, linear between them: within 1e-5 of the curve. Below 2^-14 the curve is 12.92 x. An entry has
// its value and how much greater the next is, of 65,535 and of as much again.
inline constexpr std::uint32_t kToneFirst = (127 - 14) << 8, kToneEntries = 21 << 8;
inline constexpr float kToneUnit = 65535.0f;
inline constexpr float kBackground = -1.0f;  // in place of a display-linear value: no surface
using ToneTable = std::array<std::int32_t, kToneEntries>;
template <typename Curve>
ToneTable make_tone_table(const Curve& curve) {
    const auto value = [&](std::uint32_t i) {
        return glsl::srgb_encode(curve(std::bit_cast<float>((kToneFirst + i) << 15)));
    };
    ToneTable entries{};
    for (std::uint32_t i = 0; i < entries.size(); ++i) {
        const auto low = static_cast<std::uint32_t>(value(i) * kToneUnit + 0.5f);
        const float more = value(i + 1) * kToneUnit - static_cast<float>(low);
        entries[i] =
            static_cast<std::int32_t>(low << 16 | static_cast<std::uint32_t>(std::max(more * 256.0f, 0.0f) + 0.5f));
    }
    return entries;
}
// Of the tone curve `knee`; of what another curve has bent.
inline const std::int32_t* knee_table() {
    static const ToneTable table = make_tone_table([](float x) { return glsl::shoulder(x); });
    return table.data();
}
inline const std::int32_t* plain_table() {
    static const ToneTable table = make_tone_table([](float x) { return std::min(x, 1.0f); });
    return table.data();
}
}  // namespace gonio::lighting
#endif

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_layers.h"

HWY_INLINE Float log2(Float x) {
    return hn::Log2(Tag(), x.raw);
}
HWY_INLINE Float exp2(Float x) {
    return hn::Exp(Tag(), hn::Mul(x.raw, hn::Set(Tag(), 0.693147181f)));
}
#define float Float
#define vec3 Vec3
namespace {
#include "shaders/lib/tone.glsl"
}  // namespace
#undef float
#undef vec3

// Gamma-encoded value of a display-linear one.
HWY_INLINE Float tone(const std::int32_t* table, Float x) {
    const Tag tag;
    const IntTag ints;
    const Float bounded = min(max(x, Float(0.0f)), Float(100.0f));
    const auto bits = hn::BitCast(ints, bounded.raw);
    const auto index =
        hn::Max(hn::Sub(hn::ShiftRight<15>(bits), hn::Set(ints, static_cast<int>(kToneFirst))), hn::Zero(ints));
    const Float share = hn::ConvertTo(tag, hn::And(bits, hn::Set(ints, 0x7fff)));
    const auto entry = hn::GatherIndex(ints, table, index);
    const Float low = hn::ConvertTo(tag, hn::And(hn::ShiftRight<16>(entry), hn::Set(ints, 0xffff))),
                more = hn::ConvertTo(tag, hn::And(entry, hn::Set(ints, 0xffff)));
    return mix((low + more * share * Float(1.0f / (256.0f * 32768.0f))) * Float(1.0f / kToneUnit),
               bounded * Float(12.92f), bounded < Float(0x1p-14f));
}

// One row of the light that is kept by luminaire at the pixels, in fixed-point steps. Layer after layer: as many
// streams at once as there are luminaires would be too many for the caches.
void SumRow(const Display& display, int y, std::int32_t* const* sum) {
    const std::size_t row = static_cast<std::size_t>(y) * display.row_length, length = display.row_length;
    for (int k = 0; k < 3; ++k) {
        if (display.kept_pixels[k] != nullptr)
            std::copy_n(display.kept_pixels[k] + row, length, sum[k]);
        else
            std::fill_n(sum[k], length, 0);
    }
    for (const LayerTerm& term : display.layers) add_pixels(term, display.cap, row, length, sum);
}

// One row of all light, in display units. kept: of SumRow. indirect: the grid's, or null.
void LightRow(const Display& display, int y, const std::int32_t* const* kept, const std::uint16_t* indirect,
              float* const* light) {
    const Tag tag;
    const IntTag ints;
    const std::size_t row = static_cast<std::size_t>(y) * display.row_length;
    for (std::size_t x = 0; x < display.row_length; x += hn::Lanes(tag)) {
        const auto units = [&](int k) { return hn::ConvertTo(tag, hn::LoadU(ints, kept[k] + x)); };
        Vec3 sum = Vec3(units(0), units(1), units(2)) * Float(display.per_step);
        if (indirect != nullptr) sum = sum + load_rgb(indirect + 4 * x) * Float(display.on_grid.unit);
        for (const Display::Others& other : display.others) {
            const Vec3 rgb = load_rgb(other.halves + 4 * (row + x));
            sum = sum + Vec3(rgb.x * Float(other.units.x), rgb.y * Float(other.units.y), rgb.z * Float(other.units.z));
        }
        store(sum.x, light[0] + x), store(sum.y, light[1] + x), store(sum.z, light[2] + x);
    }
}

// What surfaces make of it, display-linear, or kBackground. scale: display units per cd/m².
void ReflectRow(const Display& display, int y, float scale, const float* const* light, float* const* out) {
    const Tag tag;
    const std::size_t row = static_cast<std::size_t>(y) * display.row_length;
    for (std::size_t x = 0; x < display.row_length; x += hn::Lanes(tag)) {
        const Vec3 albedo = load_rgb(display.albedo + 4 * (row + x));
        Vec3 shown(load(light[0] + x) * albedo.x, load(light[1] + x) * albedo.y, load(light[2] + x) * albedo.z);
        if (display.emission != nullptr) {
            Raw r, g, b, a;
            hn::LoadInterleaved4(tag, display.emission + 4 * (row + x), r, g, b, a);
            shown = shown + Vec3(r, g, b) * Float(scale);
        }
        const Mask hit = Float(0.0f) < load(display.depth + row + x);
        const Float none(kBackground);
        store(mix(none, shown.x, hit), out[0] + x);
        store(mix(none, shown.y, hit), out[1] + x);
        store(mix(none, shown.z, hit), out[2] + x);
    }
}

// Display-linear, or kBackground -> the same behind haze. scale: display units per cd/m².
void AirRow(const Display& display, int y, float scale, float* const* rgb) {
    const Tag tag;
    const std::size_t row = static_cast<std::size_t>(y) * display.row_length;
    for (std::size_t x = 0; x < display.row_length; x += hn::Lanes(tag)) {
        hn::Vec<HalfBits> before[3], passed;
        hn::LoadInterleaved4(HalfBits(), display.air + 4 * (row + x), before[0], before[1], before[2], passed);
        for (int k = 0; k < 3; ++k)
            store(max(load(rgb[k] + x), Float(0.0f)) * from_half(passed) +
                      from_half(before[k]) * Float(scale * display.air_unit),
                  rgb[k] + x);
    }
}

// Display-linear -> the same in another white, bent by a tone curve other than `knee`, where there is a surface.
void LookRow(const Display& display, std::size_t length, float* const* rgb) {
    const Tag tag;
    for (std::size_t x = 0; x < length; x += hn::Lanes(tag)) {
        const Vec3 exposed(load(rgb[0] + x), load(rgb[1] + x), load(rgb[2] + x));
        const Mask none = exposed.x < Float(0.0f);
        Vec3 shown = turned(display.white, exposed);
        shown = Vec3(max(shown.x, Float(0.0f)), max(shown.y, Float(0.0f)), max(shown.z, Float(0.0f)));
        if (display.tone == Tone::agx) shown = tone_agx(shown);
        if (display.tone == Tone::aces) shown = tone_aces(shown);
        if (display.tone == Tone::neutral) shown = tone_neutral(shown);
        const Float background(kBackground);
        store(mix(shown.x, background, none), rgb[0] + x);
        store(mix(shown.y, background, none), rgb[1] + x);
        store(mix(shown.z, background, none), rgb[2] + x);
    }
}

// Display-linear -> gamma-encoded R'G'B', dithered where there is a surface.
void EncodeRow(std::size_t length, int y, const std::int32_t* table, float* const* rgb) {
    const Tag tag;
    HWY_ALIGN float dither[kSimdWidth];
    for (int i = 0; i < static_cast<int>(kSimdWidth); ++i) dither[i] = glsl::display_dither(i, y);
    const Float off(load(dither)), none(glsl::background_shade());
    for (std::size_t x = 0; x < length; x += hn::Lanes(tag)) {
        for (int k = 0; k < 3; ++k) {
            const Float shown = load(rgb[k] + x);
            store(mix(tone(table, shown) + off, none, shown < Float(0.0f)), rgb[k] + x);
        }
    }
}

HWY_INLINE hn::Vec<hn::Rebind<std::uint8_t, Tag>> to_byte(Float x) {
    return hn::DemoteTo(hn::Rebind<std::uint8_t, Tag>(), hn::NearestInt(x.raw));
}

// Two rows of R'G'B', the upper first -> two rows of Y' and one of Cb Cr (BT.709, limited range; lib/display.glsl).
void Nv12Rows(const float* const* upper, const float* const* lower, std::size_t width, std::uint8_t* upper_y,
              std::uint8_t* lower_y, std::uint8_t* chroma) {
    const Tag tag;
    const auto simd_lanes = hn::Lanes(tag);
    const hn::Rebind<std::uint8_t, Tag> bytes;
    const auto luma = [](Float r, Float g, Float b) {
        return r * Float(0.2126f) + g * Float(0.7152f) + b * Float(0.0722f);
    };
    for (std::size_t x = 0; x < width; x += 2 * simd_lanes) {
        Float mean[3];
        for (int k = 0; k < 3; ++k) {
            Raw a, b, c, d;
            hn::LoadInterleaved2(tag, upper[k] + x, a, b);
            hn::LoadInterleaved2(tag, lower[k] + x, c, d);
            mean[k] = (Float(a) + Float(b) + Float(c) + Float(d)) * Float(0.25f);
        }
        const Float y = luma(mean[0], mean[1], mean[2]);
        const Float cb = Float(128.0f) + (mean[2] - y) * Float(224.0f / 1.8556f),
                    cr = Float(128.0f) + (mean[0] - y) * Float(224.0f / 1.5748f);
        hn::StoreInterleaved2(to_byte(cb), to_byte(cr), bytes, chroma + x);
        for (std::size_t i = x; i < x + 2 * simd_lanes; i += simd_lanes) {
            const auto store_y = [&](const float* const* rgb, std::uint8_t* to) {
                hn::StoreU(
                    to_byte(Float(16.0f) + luma(load(rgb[0] + i), load(rgb[1] + i), load(rgb[2] + i)) * Float(219.0f)),
                    bytes, to + i);
            };
            store_y(upper, upper_y);
            store_y(lower, lower_y);
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(SumRow);
HWY_EXPORT(LightRow);
HWY_EXPORT(ReflectRow);
HWY_EXPORT(AirRow);
HWY_EXPORT(LookRow);
HWY_EXPORT(EncodeRow);
HWY_EXPORT(Nv12Rows);

namespace {

// A pixel that surfaces cover in part.
struct Partly {
    std::uint32_t x;
    float covered;
};

// Pixels of a row that show several surfaces. light(y): that of row y. shown: what the row's centres show, and then
// what surfaces show at all. partly: becomes the pixels that have background too.
template <typename Light>
void add_edges(const Edges& edges, int y, float scale, const Light& light, float* const* shown,
               std::vector<Partly>& partly) {
    const auto own_row = static_cast<std::size_t>(y);
    for (std::uint32_t p = edges.rows[own_row]; p < edges.rows[own_row + 1]; ++p) {
        const layouts::EdgePixel& pixel = edges.pixels[p];
        glm::vec3 sum = scale * glm::vec3(pixel.emission_nit);
        const bool background = shown[0][pixel.x] < 0.0f;
        float covered = background ? 0.0f : pixel.own;
        for (int k = 0; k < 3 && !background; ++k) sum[k] += pixel.own * shown[k][pixel.x];
        for (std::uint32_t t = pixel.first_tap; t < pixel.first_tap + pixel.count; ++t) {
            const layouts::EdgeTap& tap = edges.taps[t];
            if (tap.x == GONIO_NO_PIXEL) continue;
            covered += tap.albedo_share.w;
            const float* const* from = light(static_cast<int>(tap.y));
            for (int k = 0; k < 3; ++k) sum[k] += tap.albedo_share[k] * from[k][tap.x];
        }
        constexpr float kWhole = 0.9999f;
        if (covered < kWhole) partly.push_back({pixel.x, covered});
        for (int k = 0; k < 3; ++k) shown[k][pixel.x] = covered > 0.0f ? sum[k] / covered : kBackground;
    }
}

// Adds what a row shows of luminaires' openings.
void add_openings(std::span<const ShiningPixel> openings, int y, float scale, float* const* shown,
                  std::vector<Partly>& partly) {
    auto at = std::ranges::lower_bound(openings, static_cast<std::uint32_t>(y), {}, &ShiningPixel::y);
    for (; at != openings.end() && at->y == static_cast<std::uint32_t>(y); ++at) {
        const ShiningPixel& pixel = *at;
        const bool background = shown[0][pixel.x] < 0.0f;
        for (int k = 0; k < 3; ++k)
            shown[k][pixel.x] =
                background ? scale * pixel.nit[k] / pixel.covered : shown[k][pixel.x] + scale * pixel.nit[k];
        if (background && pixel.covered < 1.0f) partly.push_back({pixel.x, pixel.covered});
    }
}

}  // namespace

void to_nv12(const Display& display, std::uint8_t* nv12, Pool& pool) {
    const std::int32_t* table = display.tone == Tone::knee ? knee_table() : plain_table();
    const bool looks = display.tone != Tone::knee || display.white != glm::mat3(1.0f);
    const float scale = glsl::expose(glm::vec3(1.0f), display.ev100).x;
    const auto width = static_cast<std::size_t>(display.width), length = display.row_length;
    // Eight pairs of rows a job: its scratch stays in the cache. Edges take light of the rows beside them too.
    constexpr int kPairs = 8;
    const int pairs = display.height / 2, beside = display.edges != nullptr ? 1 : 0;
    pool.run((pairs + kPairs - 1) / kPairs, [&](int job) {
        static thread_local std::vector<float> lit, rgb;
        static thread_local std::vector<std::int32_t> steps;
        static thread_local std::vector<std::uint16_t> from_grid;
        static thread_local std::vector<std::uint8_t> bytes;
        static thread_local std::vector<Partly> partly;
        const int last_pair = std::min(pairs, (job + 1) * kPairs), top = display.height - 1 - 2 * job * kPairs,
                  low = std::max(display.height - 2 * last_pair - beside, 0),
                  high = std::min(top + beside, display.height - 1);
        lit.resize(3 * length * static_cast<std::size_t>(2 * (kPairs + 1)));
        steps.resize(3 * length);
        rgb.resize(6 * length);
        from_grid.resize(4 * length);
        bytes.resize(3 * length);
        const Display::OnGrid& on_grid = display.on_grid;
        std::uint16_t* const indirect = on_grid.planes != nullptr ? from_grid.data() : nullptr;
        std::int32_t* const kept[3] = {steps.data(), steps.data() + length, steps.data() + 2 * length};
        float* light[2 * (kPairs + 1)][3];
        for (int y = low; y <= high; ++y) {
            float* const* row = light[y - low];
            for (int k = 0; k < 3; ++k)
                light[y - low][k] = lit.data() + static_cast<std::size_t>(3 * (y - low) + k) * length;
            HWY_DYNAMIC_DISPATCH(SumRow)(display, y, kept);
            if (indirect != nullptr) upsample_line(*on_grid.gbuffer, *on_grid.screen, *on_grid.planes, y, indirect);
            HWY_DYNAMIC_DISPATCH(LightRow)(display, y, kept, indirect, row);
        }
        float* const upper[3] = {rgb.data(), rgb.data() + length, rgb.data() + 2 * length};
        float* const lower[3] = {rgb.data() + 3 * length, rgb.data() + 4 * length, rgb.data() + 5 * length};
        for (int pair = job * kPairs; pair < last_pair; ++pair) {
            const int first = display.height - 1 - 2 * pair;
            for (const auto& [y, row] : {std::pair(first, upper), std::pair(first - 1, lower)}) {
                partly.clear();
                HWY_DYNAMIC_DISPATCH(ReflectRow)(display, y, scale, light[y - low], row);
                if (display.edges != nullptr)
                    add_edges(
                        *display.edges, y, scale, [&](int at) { return light[at - low]; }, row, partly);
                add_openings(display.openings, y, scale, row, partly);
                if (display.air != nullptr) HWY_DYNAMIC_DISPATCH(AirRow)(display, y, scale, row);
                if (looks) HWY_DYNAMIC_DISPATCH(LookRow)(display, length, row);
                HWY_DYNAMIC_DISPATCH(EncodeRow)(length, y, table, row);
                for (const Partly& pixel : partly) {
                    for (int k = 0; k < 3; ++k)
                        row[k][pixel.x] = glm::mix(glsl::background_shade(), row[k][pixel.x], pixel.covered);
                }
            }
            HWY_DYNAMIC_DISPATCH(Nv12Rows)
            (upper, lower, length, bytes.data(), bytes.data() + length, bytes.data() + 2 * length);
            std::uint8_t* luma = nv12 + static_cast<std::size_t>(2 * pair) * width;
            std::memcpy(luma, bytes.data(), width);
            std::memcpy(luma + width, bytes.data() + length, width);
            std::memcpy(nv12 + (static_cast<std::size_t>(display.height) + static_cast<std::size_t>(pair)) * width,
                        bytes.data() + 2 * length, width);
        }
    });
}

}  // namespace gonio::lighting
#endif
