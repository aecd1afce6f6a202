#include "server/shade/display.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "server/shade/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/shade/display.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// The tone curve as a table over the bits of its argument, defined once for all instruction sets.
#ifndef GONIO_SHADE_TONE_TABLE
#define GONIO_SHADE_TONE_TABLE
#include "shaders/lib/as_cpp.h"
namespace gonio::shade {
// 256 values per octave, linear between them: within 1e-5 of the curve. Below 2^-14 the curve is 12.92 x.
inline constexpr std::uint32_t kToneFirst = (127 - 14) << 8, kToneEntries = 21 << 8;
inline const float* tone_table() {
    static const auto table = [] {
        std::array<float, kToneEntries + 2> values{};
        for (std::uint32_t i = 0; i < values.size(); ++i) {
            values[i] = glsl::srgb_encode(glsl::shoulder(std::bit_cast<float>((kToneFirst + i) << 15)));
        }
        return values;
    }();
    return table.data();
}
}  // namespace gonio::shade
#endif

HWY_BEFORE_NAMESPACE();
namespace gonio::shade {
namespace HWY_NAMESPACE {

#include "server/shade/lanes.h"

using HalfBits = hn::Rebind<std::uint16_t, Tag>;
using Halves = hn::Rebind<hwy::float16_t, Tag>;

HWY_INLINE Float from_half(hn::Vec<HalfBits> bits) {
    return hn::PromoteTo(Tag(), hn::BitCast(Halves(), bits));
}
HWY_INLINE Vec3 load_rgb(const std::uint16_t* pixels) {
    hn::Vec<HalfBits> r, g, b, a;
    hn::LoadInterleaved4(HalfBits(), pixels, r, g, b, a);
    return {from_half(r), from_half(g), from_half(b)};
}

// Gamma-encoded value of a display-linear one.
HWY_INLINE Float tone(const float* table, Float x) {
    const Tag tag;
    const IntTag ints;
    const Float bounded = min(max(x, Float(0.0f)), Float(100.0f));
    const auto bits = hn::BitCast(ints, bounded.raw);
    const auto index =
        hn::Max(hn::Sub(hn::ShiftRight<15>(bits), hn::Set(ints, static_cast<int>(kToneFirst))), hn::Zero(ints));
    const Float share =
        hn::Mul(hn::ConvertTo(tag, hn::And(bits, hn::Set(ints, 0x7fff))), hn::Set(tag, 1.0f / 32768.0f));
    const Float low = hn::GatherIndex(tag, table, index), high = hn::GatherIndex(tag, table + 1, index);
    return mix(low + (high - low) * share, bounded * Float(12.92f), bounded < Float(0x1p-14f));
}

// One row of gamma-encoded R'G'B' with ordered dither.
void EncodeRow(const Display& display, int y, const float* table, float scale, float* red, float* green, float* blue) {
    const Tag tag;
    const auto lanes = hn::Lanes(tag);
    const std::size_t row = static_cast<std::size_t>(y) * display.row_length;
    HWY_ALIGN float dither[kLanes];
    for (int i = 0; i < static_cast<int>(kLanes); ++i) dither[i] = glsl::display_dither(i, y);
    for (std::size_t x = 0; x < display.row_length; x += lanes) {
        const std::size_t at = row + x;
        Vec3 light;
        for (const Layer& layer : display.layers) {
            const Vec3 weight(layer.weight.x, layer.weight.y, layer.weight.z);
            if (display.direct) light = light + weight * from_half(hn::LoadU(HalfBits(), layer.direct + at));
            if (!display.indirect) continue;
            const Vec3 bounced = load_rgb(layer.indirect + 4 * at);
            light = light + Vec3(weight.x * bounced.x, weight.y * bounced.y, weight.z * bounced.z);
        }
        const Vec3 albedo = load_rgb(display.albedo + 4 * at);
        const Float share(display.gain * scale / 3.14159265f);
        Vec3 shown(light.x * albedo.x * share, light.y * albedo.y * share, light.z * albedo.z * share);
        if (display.emission != nullptr) {
            Raw r, g, b, a;
            hn::LoadInterleaved4(tag, display.emission + 4 * at, r, g, b, a);
            shown = shown + Vec3(r, g, b) * Float(scale);
        }
        const Mask hit = Float(0.0f) < load(display.depth + x + row);
        const Float off(load(dither)), none(glsl::background_shade());
        store(mix(none, tone(table, shown.x) + off, hit), red + x);
        store(mix(none, tone(table, shown.y) + off, hit), green + x);
        store(mix(none, tone(table, shown.z) + off, hit), blue + x);
    }
}

HWY_INLINE hn::Vec<hn::Rebind<std::uint8_t, Tag>> to_byte(Float x) {
    return hn::DemoteTo(hn::Rebind<std::uint8_t, Tag>(), hn::NearestInt(x.raw));
}

// Two rows of R'G'B', the upper first -> two rows of Y' and one of Cb Cr (BT.709, limited range; lib/display.glsl).
void Nv12Rows(const float* const* upper, const float* const* lower, std::size_t width, std::uint8_t* upper_y,
              std::uint8_t* lower_y, std::uint8_t* chroma) {
    const Tag tag;
    const auto lanes = hn::Lanes(tag);
    const hn::Rebind<std::uint8_t, Tag> bytes;
    const auto luma = [](Float r, Float g, Float b) {
        return r * Float(0.2126f) + g * Float(0.7152f) + b * Float(0.0722f);
    };
    for (std::size_t x = 0; x < width; x += 2 * lanes) {
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
        for (std::size_t i = x; i < x + 2 * lanes; i += lanes) {
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
}  // namespace gonio::shade
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::shade {

HWY_EXPORT(EncodeRow);
HWY_EXPORT(Nv12Rows);

void to_nv12(const Display& display, std::uint8_t* nv12, Pool& pool) {
    const float* table = tone_table();
    const float scale = glsl::expose(glm::vec3(1.0f), display.ev100).x;
    const auto width = static_cast<std::size_t>(display.width), length = display.row_length;
    // Eight pairs of rows a job: its scratch stays in the cache.
    constexpr int kPairs = 8;
    const int pairs = display.height / 2;
    pool.run((pairs + kPairs - 1) / kPairs, [&](int job) {
        static thread_local std::vector<float> rgb;
        static thread_local std::vector<std::uint8_t> bytes;
        rgb.resize(6 * length);
        bytes.resize(3 * length);
        float* const upper[3] = {rgb.data(), rgb.data() + length, rgb.data() + 2 * length};
        float* const lower[3] = {rgb.data() + 3 * length, rgb.data() + 4 * length, rgb.data() + 5 * length};
        for (int pair = job * kPairs; pair < std::min(pairs, (job + 1) * kPairs); ++pair) {
            const int top = display.height - 1 - 2 * pair;
            HWY_DYNAMIC_DISPATCH(EncodeRow)(display, top, table, scale, upper[0], upper[1], upper[2]);
            HWY_DYNAMIC_DISPATCH(EncodeRow)(display, top - 1, table, scale, lower[0], lower[1], lower[2]);
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

}  // namespace gonio::shade
#endif
