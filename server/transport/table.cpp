#include "server/transport/table.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/transport/table.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::transport {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The four values of an entry are one vector, or, without vectors, four of one component each.
using Four = hn::CappedTag<float, 4>;
using FourHalves = hn::Rebind<hwy::float16_t, Four>;
constexpr std::size_t kStep = HWY_TARGET == HWY_SCALAR ? 1 : 4;

HWY_INLINE hn::Vec<Four> entry(const std::uint16_t* halves, std::uint16_t id) {
    return hn::PromoteTo(Four(), hn::LoadU(FourHalves(), reinterpret_cast<const hwy::float16_t*>(halves) +
                                                             4 * static_cast<std::size_t>(id)));
}

void Gather(const std::uint16_t* table, const LinkRun& run, float share, glm::vec4* sums) {
    auto [ids, stride, count, size] = run;
    const Four four;
    for (std::size_t i = 0; i < size; ++i, ids += stride) {
        for (std::size_t component = 0; component < 4; component += kStep) {
            auto a = hn::Zero(four), b = a, c = a, d = a;
            for (unsigned k = 0; k < count; k += 4) {
                std::uint64_t four_ids;  // one load in place of four
                std::memcpy(&four_ids, ids + k, sizeof four_ids);
                const auto id = [&](int which) { return static_cast<std::uint16_t>(four_ids >> 16 * which); };
                a = hn::Add(a, entry(table + component, id(0)));
                b = hn::Add(b, entry(table + component, id(1)));
                c = hn::Add(c, entry(table + component, id(2)));
                d = hn::Add(d, entry(table + component, id(3)));
            }
            float* to = &sums[i][0] + component;
            hn::StoreU(hn::MulAdd(hn::Add(hn::Add(a, b), hn::Add(c, d)), hn::Set(four, share), hn::LoadU(four, to)),
                       four, to);
        }
    }
}

// weights: of the surfels `ids` at p.
void Weigh(const float* const* points, const std::uint16_t* ids, const glm::vec3& p, const glm::vec3& n, float reach,
           float* weights) {
    const hn::CappedTag<float, kNeighbours> tag;
    const hn::RebindToSigned<decltype(tag)> ints;
    const hn::Rebind<std::uint16_t, decltype(tag)> shorts;
    using V = hn::Vec<decltype(tag)>;
    const auto set = [&](float x) { return hn::Set(tag, x); };
    const auto dot = [&](V ax, V ay, V az, V bx, V by, V bz) {
        return hn::MulAdd(ax, bx, hn::MulAdd(ay, by, hn::Mul(az, bz)));
    };
    V sum = hn::Zero(tag);
    for (std::size_t k = 0; k < kNeighbours; k += hn::Lanes(tag)) {
        const auto id = hn::PromoteTo(ints, hn::LoadU(shorts, ids + k));
        const auto at = [&](int i) { return hn::GatherIndex(tag, points[i], id); };
        const V dx = hn::Sub(at(0), set(p.x)), dy = hn::Sub(at(1), set(p.y)), dz = hn::Sub(at(2), set(p.z));
        const V mx = at(3), my = at(4), mz = at(5), nx = set(n.x), ny = set(n.y), nz = set(n.z);
        const V off = dot(dx, dy, dz, nx, ny, nz), off_other = dot(dx, dy, dz, mx, my, mz),
                agree = hn::Max(hn::Sub(dot(mx, my, mz, nx, ny, nz), set(0.45f)), hn::Zero(tag));
        const V far =
            hn::MulAdd(hn::MulAdd(off, off, hn::Mul(off_other, off_other)), set(8.0f), dot(dx, dy, dz, dx, dy, dz));
        const V near = hn::Max(hn::NegMulAdd(far, set(1.0f / (reach * reach)), set(1.0f)), hn::Zero(tag));
        const V weight = hn::Mul(hn::Mul(near, near), agree);  // 0 for an id of none: its normal is 0
        hn::StoreU(weight, tag, weights + k);
        sum = hn::Add(sum, weight);
    }
    const float all = hn::GetLane(hn::SumOfLanes(tag, sum));
    if (!(all > 1e-6f)) {  // alone, and not much like the point
        for (std::size_t k = 0; k < kNeighbours; ++k) weights[k] = k == 0 ? 1.0f : 0.0f;
        return;
    }
    for (std::size_t k = 0; k < kNeighbours; k += hn::Lanes(tag))
        hn::StoreU(hn::Mul(hn::LoadU(tag, weights + k), set(1.0f / all)), tag, weights + k);
}

void Blend(const std::uint16_t* table, const std::uint16_t* const* ids, const float* weights, std::size_t size,
           float unit, glm::vec4* out) {
    const Four four;
    for (std::size_t i = 0; i < size; ++i, weights += kNeighbours) {
        for (std::size_t component = 0; component < 4; component += kStep) {
            auto a = hn::Zero(four), b = a;
            if (const std::uint16_t* own = ids[i]) {
                for (std::size_t k = 0; k < kNeighbours; k += 2) {
                    a = hn::MulAdd(entry(table + component, own[k]), hn::Set(four, weights[k]), a);
                    b = hn::MulAdd(entry(table + component, own[k + 1]), hn::Set(four, weights[k + 1]), b);
                }
            }
            hn::StoreU(hn::Mul(hn::Add(a, b), hn::Set(four, unit)), four, &out[i][0] + component);
        }
    }
}

void Halve(const glm::vec4* values, std::size_t size, float factor, std::uint16_t* halves) {
    const Four four;
    for (std::size_t i = 0; i < size; ++i) {
        for (std::size_t component = 0; component < 4; component += kStep)
            hn::StoreU(
                hn::DemoteTo(FourHalves(), hn::Mul(hn::LoadU(four, &values[i][0] + component), hn::Set(four, factor))),
                FourHalves(), reinterpret_cast<hwy::float16_t*>(halves) + 4 * i + component);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::transport
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::transport {

HWY_EXPORT(Gather);
HWY_EXPORT(Blend);
HWY_EXPORT(Weigh);
HWY_EXPORT(Halve);

namespace {

constexpr float kGreatest = 1000.0f;

}  // namespace

void gather(const Table& table, const LinkRun& run, float share, glm::vec4* sums) {
    HWY_DYNAMIC_DISPATCH(Gather)(table.halves.data(), run, share, sums);
}

void weigh(const Surfels& surfels, const std::uint16_t* ids, const glm::vec3& p, const glm::vec3& n, float* weights) {
    const float* points[6];
    for (std::size_t k = 0; k < 6; ++k) points[k] = surfels.points[k].data();
    HWY_DYNAMIC_DISPATCH(Weigh)(points, ids, p, n, kBlendRadii * surfels.radius_m, weights);
}

void blend(const Table& table, const std::uint16_t* const* ids, const float* weights, std::size_t size,
           glm::vec4* out) {
    HWY_DYNAMIC_DISPATCH(Blend)(table.halves.data(), ids, weights, size, table.unit, out);
}

void make_table(std::span<const glm::vec4> values, Table& table, Pool& pool) {
    const auto greatest_of = [&](std::size_t first, std::size_t count) {
        float most = 0.0f;
        for (const glm::vec4& value : values.subspan(first, count))
            most = std::max({most, std::abs(value.r), std::abs(value.g), std::abs(value.b)});
        return most;
    };
    const float most = pool.reduce_chunks(values.size(), kSurfelsAJob, 0.0f, greatest_of,
                                          [](float a, float b) { return std::max(a, b); });
    table.halves.assign((values.size() + 1) * 4, 0);
    constexpr float kLeast = 1e-30f;  // dimmer light is none: 1 / unit stays finite
    table.unit = std::isfinite(most) && most > kLeast ? most / kGreatest : 0.0f;
    if (!(table.unit > 0.0f)) return;
    pool.run_chunks(values.size(), kSurfelsAJob, [&](std::size_t first, std::size_t count) {
        HWY_DYNAMIC_DISPATCH(Halve)(values.data() + first, count, 1.0f / table.unit, table.halves.data() + 4 * first);
    });
}

}  // namespace gonio::transport
#endif
