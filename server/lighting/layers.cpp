#include "server/lighting/layers.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/layers.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_layers.h"

void AddPixels(const LayerTerm& term, float cap, std::size_t first, std::size_t count, std::int32_t* const* sums) {
    add_pixels(term, cap, first, count, sums);
}

void AddPlane(const std::uint16_t* light, float steps, float cap, std::size_t count, std::int32_t* sum) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag()))
        add_fixed_point(from_half(hn::LoadU(HalfBits(), light + i)), Float(steps), Float(cap), sum + i);
}

void ToFloats(const std::int32_t* sum, float factor, std::size_t count, float* out) {
    const Tag tag;
    const IntTag ints;
    for (std::size_t i = 0; i < count; i += hn::Lanes(ints))
        store(Float(hn::ConvertTo(tag, hn::LoadU(ints, sum + i))) * Float(factor), out + i);
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(AddPixels);
HWY_EXPORT(AddPlane);
HWY_EXPORT(ToFloats);

namespace {

// A luminaire that changed among few others is expected to change again within so many pictures.
constexpr std::uint64_t kRestless = 32;
// Fewer are not worth keeping: a kept sum has six times the bytes of a layer.
constexpr std::size_t kFewest = 8;
// Values at a time: three sums of them stay in the second cache while layer after layer is added.
constexpr std::size_t kChunk = 8192;

}  // namespace

void LayerSum::take(const std::vector<LayerTerm>& terms, std::size_t most, std::size_t pixels, std::size_t points,
                    Pool& pool) {
    ++pictures_;
    // No sum of so many terms overflows.
    const std::int64_t bound = (std::int64_t{1} << 31) / static_cast<std::int64_t>(2 * most + 1);
    const auto cap = static_cast<float>(bound);
    bool valid = any_kept_ && cap == cap_ && pixels_[0].size() == pixels && grid_[0].size() == points;
    bool moved = cap != cap_;
    cap_ = cap;

    std::map<std::uint32_t, Known> now;
    std::vector<std::uint32_t> changed;
    for (const LayerTerm& term : terms) {
        const auto before = known_.find(term.light);
        Known& known = now[term.light];
        if (before != known_.end()) known = before->second;
        if (before == known_.end() || known.share != term) {
            changed.push_back(term.light);
            valid = valid && !known.kept;
        }
        known.share = term;
    }
    for (const auto& [light, known] : known_) {
        if (now.contains(light)) continue;
        moved = true;
        valid = valid && !known.kept;
    }
    known_ = std::move(now);
    moved |= !changed.empty();
    changes_ += moved ? 1 : 0;
    if (2 * changed.size() <= terms.size()) {
        for (const std::uint32_t light : changed) known_[light].changed_in = pictures_;
    }
    if (!valid) {
        for (auto& [light, known] : known_) known.kept = false;
    }

    std::vector<LayerTerm> quiet;
    for (const LayerTerm& term : terms) {
        const Known& known = known_[term.light];
        const bool rests = known.changed_in == 0 || pictures_ - known.changed_in > kRestless;
        const bool same = std::find(changed.begin(), changed.end(), term.light) == changed.end();
        if (!known.kept && rests && same) quiet.push_back(term);
    }
    if (quiet.size() >= kFewest) {
        if (!valid) {
            for (auto& sum : pixels_) sum.assign(pixels, 0);
            for (auto& sum : grid_) sum.assign(points, 0);
        }
        keep(quiet, pool);
        valid = true;
    }
    any_kept_ = valid;
    others_.clear();
    for (const LayerTerm& term : terms) {
        if (!known_[term.light].kept) others_.push_back(term);
    }
}

// Adds terms to what is kept.
void LayerSum::keep(std::span<const LayerTerm> terms, Pool& pool) {
    for (const LayerTerm& term : terms) known_[term.light].kept = true;
    pool.run_chunks(pixels_[0].size(), kChunk, [&](std::size_t first, std::size_t count) {
        std::int32_t* const sums[] = {&pixels_[0][first], &pixels_[1][first], &pixels_[2][first]};
        for (const LayerTerm& term : terms) HWY_DYNAMIC_DISPATCH(AddPixels)(term, cap_, first, count, sums);
    });
    for (std::size_t k = 0; k < 3; ++k) {
        pool.run_chunks(grid_[k].size(), kChunk, [&](std::size_t first, std::size_t count) {
            for (const LayerTerm& term : terms) {
                if (term.on_grid()) HWY_DYNAMIC_DISPATCH(AddPlane)
                (term.layer->indirect[k].data() + first, term.steps[static_cast<int>(k)], cap_, count,
                 &grid_[k][first]);
            }
        });
    }
}

const std::int32_t* LayerSum::kept_pixels(int channel) const {
    return any_kept_ ? pixels_[static_cast<std::size_t>(channel)].data() : nullptr;
}

void LayerSum::grid(float per_step, Planes& out, Pool& pool) const {
    for (std::size_t k = 0; k < 3; ++k) {
        pool.run_chunks(out[k].size() / kSimdWidth * kSimdWidth, kChunk, [&](std::size_t first, std::size_t count) {
            static thread_local std::vector<std::int32_t> sum;
            sum.resize(kChunk);
            if (any_kept_)
                std::copy_n(grid_[k].data() + first, count, sum.data());
            else
                std::fill_n(sum.data(), count, 0);
            for (const LayerTerm& term : others_) {
                if (term.on_grid()) HWY_DYNAMIC_DISPATCH(AddPlane)
                (term.layer->indirect[k].data() + first, term.steps[static_cast<int>(k)], cap_, count, sum.data());
            }
            HWY_DYNAMIC_DISPATCH(ToFloats)(sum.data(), per_step, count, out[k].data() + first);
        });
    }
}

}  // namespace gonio::lighting
#endif
