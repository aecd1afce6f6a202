#include "server/lighting/edge_filter.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <glm/glm.hpp>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/edge_filter.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Pixels of a row that have pixels on both sides, from 1 on. marks: not 0 where an edge may cross one. Result: the
// first pixel that was not looked at.
std::size_t MarkEdges(const std::uint8_t* up, const std::uint8_t* row, const std::uint8_t* down, std::size_t width,
                      std::uint8_t* marks) {
    const hn::ScalableTag<std::uint8_t> tag;
    const auto black = hn::Set(tag, 16), least = hn::Set(tag, 9);
    std::size_t x = 1;
    for (; x + hn::Lanes(tag) < width; x += hn::Lanes(tag)) {
        const auto n = hn::LoadU(tag, up + x), s = hn::LoadU(tag, down + x), w = hn::LoadU(tag, row + x - 1),
                   e = hn::LoadU(tag, row + x + 1), here = hn::LoadU(tag, row + x);
        const auto low = hn::Min(hn::Min(hn::Min(n, s), hn::Min(w, e)), here),
                   high = hn::Max(hn::Max(hn::Max(n, s), hn::Max(w, e)), here);
        const auto needed = hn::Max(least, hn::ShiftRight<2>(hn::SaturatedSub(high, black))),
                   differ = hn::Sub(high, low);
        hn::StoreU(hn::VecFromMask(tag, hn::Eq(hn::Max(differ, needed), differ)), tag, marks + x);
    }
    return x;
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(MarkEdges);

namespace {

using namespace glm;

// As far as edge_filter.glsl looks beyond a pixel.
constexpr int kBorder = 9;

struct LumaPlane {
    const std::uint8_t*
        corner;  // the top left pixel of a picture, which has kBorder pixels of its border's luma around it
    std::ptrdiff_t stride;
    std::array<float, 256> luma_of;
    float luma_at(const ivec2& pixel) const { return luma_of[corner[pixel.y * stride + pixel.x]]; }
#include "shaders/lib/edge_filter.glsl"
};

}  // namespace

void filter_edges(int width, int height, std::uint8_t* luma, std::vector<std::uint8_t>& before, Pool& pool) {
    const auto length = static_cast<std::size_t>(width), stride = length + 2 * kBorder;
    before.resize(stride * static_cast<std::size_t>(height + 2 * kBorder));
    const auto row_at = [&](int y) { return before.data() + stride * static_cast<std::size_t>(y + kBorder) + kBorder; };
    for (int y = -kBorder; y < height + kBorder; ++y) {
        const std::uint8_t* from = luma + length * static_cast<std::size_t>(std::clamp(y, 0, height - 1));
        std::memset(row_at(y) - kBorder, from[0], kBorder);
        std::memcpy(row_at(y), from, length);
        std::memset(row_at(y) + length, from[length - 1], kBorder);
    }
    LumaPlane plane{row_at(0), static_cast<std::ptrdiff_t>(stride), {}};
    for (int i = 0; i < 256; ++i) plane.luma_of[static_cast<std::size_t>(i)] = (static_cast<float>(i) - 16.0f) / 219.0f;
    constexpr int kRows = 8;  // a job
    pool.run((height + kRows - 1) / kRows, [&](int job) {
        static thread_local std::vector<std::uint8_t> marks;
        marks.resize(length);
        for (int y = job * kRows; y < std::min(height, (job + 1) * kRows); ++y) {
            std::uint8_t* out = luma + static_cast<std::size_t>(y) * length;
            const auto filter = [&](std::size_t x) {
                const float filtered = plane.edge_filtered(ivec2(static_cast<int>(x), y));
                out[x] = static_cast<std::uint8_t>(16.5f + 219.0f * filtered);
            };
            filter(0);
            auto x = HWY_DYNAMIC_DISPATCH(MarkEdges)(row_at(y - 1), row_at(y), row_at(y + 1), length, marks.data());
            for (std::size_t i = 1; i < x; ++i) {
                std::uint64_t eight = 0;
                if (i + sizeof eight <= x && (std::memcpy(&eight, marks.data() + i, sizeof eight), eight == 0))
                    i += sizeof eight - 1;
                else if (marks[i] != 0)
                    filter(i);
            }
            for (; x < length; ++x) filter(x);
        }
    });
}

}  // namespace gonio::lighting
#endif
