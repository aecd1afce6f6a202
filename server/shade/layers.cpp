#include "server/shade/layers.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/shade/layers.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::shade {
namespace HWY_NAMESPACE {

#include "server/shade/lanes.h"
#include "server/shade/layer_lanes.h"

// Adds a layer's values, `count` of them, a multiple of the lanes, to three sums, each with its own factor.
void AddDirect(const std::uint16_t* light, const glm::vec3& quanta, float cap, std::size_t count, std::int32_t* red,
               std::int32_t* green, std::int32_t* blue) {
    const IntTag ints;
    const Float r(quanta.x), g(quanta.y), b(quanta.z), most(cap);
    for (std::size_t i = 0; i < count; i += hn::Lanes(ints)) {
        const Float value = from_half(hn::LoadU(HalfBits(), light + i));
        const auto add = [&](Float factor, std::int32_t* sum) {
            hn::StoreU(hn::Add(hn::LoadU(ints, sum + i), whole_quanta(value, factor, most)), ints, sum + i);
        };
        add(r, red), add(g, green), add(b, blue);
    }
}

void AddPlane(const std::uint16_t* light, float quanta, float cap, std::size_t count, std::int32_t* sum) {
    const IntTag ints;
    const Float factor(quanta), most(cap);
    for (std::size_t i = 0; i < count; i += hn::Lanes(ints)) {
        const Float value = from_half(hn::LoadU(HalfBits(), light + i));
        hn::StoreU(hn::Add(hn::LoadU(ints, sum + i), whole_quanta(value, factor, most)), ints, sum + i);
    }
}

void ToFloats(const std::int32_t* sum, float factor, std::size_t count, float* out) {
    const Tag tag;
    const IntTag ints;
    for (std::size_t i = 0; i < count; i += hn::Lanes(ints))
        store(Float(hn::ConvertTo(tag, hn::LoadU(ints, sum + i))) * Float(factor), out + i);
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::shade
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::shade {

HWY_EXPORT(AddDirect);
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

void LayerSum::take(std::vector<LayerTerm> terms, std::size_t most, bool direct, bool indirect, Pool& pool) {
    ++pictures_;
    // No sum of so many terms overflows.
    const float cap = static_cast<float>((std::int64_t{1} << 31) / static_cast<std::int64_t>(most + 1));
    bool valid = any_kept_ && cap == cap_ && (with_direct_ || !direct) && (with_indirect_ || !indirect);
    bool moved = cap != cap_;
    cap_ = cap;

    std::map<std::uint32_t, Known> now;
    std::vector<std::uint32_t> changed;
    for (const LayerTerm& term : terms) {
        Known known{term.layer->version, 0, term.quanta, false};
        const auto before = known_.find(term.light);
        if (before != known_.end()) {
            known.changed_in = before->second.changed_in;
            known.kept = before->second.kept;
        }
        if (before == known_.end() || before->second.version != known.version ||
            before->second.quanta != known.quanta) {
            changed.push_back(term.light);
            valid = valid && !known.kept;
        }
        now.emplace(term.light, known);
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
        // A part that is not looked at may be old in what is added now.
        with_direct_ = direct && (with_direct_ || !valid);
        with_indirect_ = indirect && (with_indirect_ || !valid);
        keep(quiet, !valid, pool);
        valid = true;
    }
    any_kept_ = valid;
    others_.clear();
    for (const LayerTerm& term : terms) {
        if (!known_[term.light].kept) others_.push_back(term);
    }
}

// Adds terms to what is kept; anew: after forgetting it.
void LayerSum::keep(std::span<const LayerTerm> terms, bool anew, Pool& pool) {
    for (const LayerTerm& term : terms) known_[term.light].kept = true;
    const auto prepare = [&](std::array<std::vector<std::int32_t>, 3>& sums, std::size_t size) {
        for (auto& sum : sums) sum.resize(size);
    };
    const LightLayer& shape = *terms.front().layer;
    if (with_direct_) {
        prepare(direct_, shape.direct.size());
        pool.run_chunks(shape.direct.size(), kChunk, [&](std::size_t first, std::size_t count) {
            std::int32_t* const sums[] = {&direct_[0][first], &direct_[1][first], &direct_[2][first]};
            if (anew) {
                for (std::int32_t* sum : sums) std::fill_n(sum, count, 0);
            }
            for (const LayerTerm& term : terms) HWY_DYNAMIC_DISPATCH(AddDirect)
            (term.layer->direct.data() + first, term.quanta, cap_, count, sums[0], sums[1], sums[2]);
        });
    }
    if (!with_indirect_) return;
    prepare(indirect_, shape.indirect[0].size());
    for (std::size_t k = 0; k < 3; ++k) {
        pool.run_chunks(shape.indirect[k].size(), kChunk, [&](std::size_t first, std::size_t count) {
            std::int32_t* sum = &indirect_[k][first];
            if (anew) std::fill_n(sum, count, 0);
            for (const LayerTerm& term : terms) HWY_DYNAMIC_DISPATCH(AddPlane)
            (term.layer->indirect[k].data() + first, term.quanta[static_cast<int>(k)], cap_, count, sum);
        });
    }
}

const std::int32_t* LayerSum::kept_direct(int channel) const {
    return any_kept_ ? direct_[static_cast<std::size_t>(channel)].data() : nullptr;
}

void LayerSum::indirect(float per_quantum, Planes& out, Pool& pool) const {
    for (std::size_t k = 0; k < 3; ++k) {
        pool.run_chunks(out[k].size() / kLanes * kLanes, kChunk, [&](std::size_t first, std::size_t count) {
            static thread_local std::vector<std::int32_t> sum;
            sum.resize(kChunk);
            if (any_kept_)
                std::copy_n(indirect_[k].data() + first, count, sum.data());
            else
                std::fill_n(sum.data(), count, 0);
            for (const LayerTerm& term : others_) HWY_DYNAMIC_DISPATCH(AddPlane)
            (term.layer->indirect[k].data() + first, term.quanta[static_cast<int>(k)], cap_, count, sum.data());
            HWY_DYNAMIC_DISPATCH(ToFloats)(sum.data(), per_quantum, count, out[k].data() + first);
        });
    }
}

}  // namespace gonio::shade
#endif
