#include "server/transport/solve.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/transport/solve.cpp"
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
constexpr std::size_t kChunk = 1024;  // surfels a job

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
        for (const glm::vec4& value : values.subspan(first, count)) most = std::max({most, value.r, value.g, value.b});
        return most;
    };
    const float most =
        pool.reduce_chunks(values.size(), kChunk, 0.0f, greatest_of, [](float a, float b) { return std::max(a, b); });
    table.halves.assign((values.size() + 1) * 4, 0);
    table.unit = std::isfinite(most) && most > 0.0f ? most / kGreatest : 0.0f;
    if (!(table.unit > 0.0f)) return;
    pool.run_chunks(values.size(), kChunk, [&](std::size_t first, std::size_t count) {
        HWY_DYNAMIC_DISPATCH(Halve)(values.data() + first, count, 1.0f / table.unit, table.halves.data() + 4 * first);
    });
}

void radiosity(const Surfels& surfels, float share, std::span<const glm::vec4> direct,
               std::span<const glm::vec4> indirect, std::vector<glm::vec4>& out, Pool& pool) {
    out.resize(surfels.count);
    pool.run_chunks(surfels.count, kChunk, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i)
            out[i] = glm::vec4(surfels.albedo[i], 0.0f) *
                     (share * direct[i] + (indirect.empty() ? glm::vec4(0.0f) : indirect[i]));
    });
}

namespace {

// Later bounces are smooth: they follow the first `near` of a surfel's links. What the links after them, up to `all`,
// find of the first bounce goes along with E.
struct Followed {
    unsigned near, all;
};
// While light moves; of surfels that the picture does not show, whose light is averaged once more before it comes
// there.
constexpr Followed kSeen{128, 256}, kUnseen{32, 64};

// sums[i] += share × the sum of what the table holds over the links `from` … `to` − 1 of surfels first … first + size
// − 1. Eight parameters: a run of links, what is carried, and a run of sums.
void transfer(const Links& links, unsigned from, unsigned to, const Table& table, float share, std::size_t first,
              std::size_t size, std::vector<glm::vec4>& sums) {
    for (const auto& set : links.sets) {
        const unsigned low = std::max(from, set->first), high = std::min(to, set->first + set->count);
        if (table.unit > 0.0f && low < high)
            gather(table, {set->ids.data() + first * set->count + (low - set->first), set->count, high - low, size},
                   share * table.unit, sums.data() + first);
    }
}

// The brightest tenth of the surfels, without those that send next to nothing.
struct Brightest {
    std::vector<std::uint16_t> ids;
    float narrow = 0.0f;  // 1 where they send all but a five-hundredth of the light, 0 where all but a hundredth
};
Brightest brightest_of(const Surfels& surfels, const std::vector<glm::vec4>& sent, Pool& pool) {
    const std::size_t n = surfels.count, few = n / 10;
    std::vector<float> power(n);
    const auto power_of = [&](std::size_t begin, std::size_t count) {
        double sum = 0.0;
        for (std::size_t i = begin; i < begin + count; ++i) {
            power[i] = surfels.area_m2[i] * (0.2126f * sent[i].r + 0.7152f * sent[i].g + 0.0722f * sent[i].b);
            sum += static_cast<double>(power[i]);
        }
        return sum;
    };
    const double all = pool.reduce_chunks(n, kChunk, 0.0, power_of, std::plus<>());
    double theirs = 0.0;
    Brightest result;
    const double mean = all / static_cast<double>(std::max<std::size_t>(n, 1));
    // Were all but a hundredth of the light a tenth's, at most a twentieth more would send a fifth of the mean.
    const auto bright =
        std::count_if(power.begin(), power.end(), [&](float p) { return static_cast<double>(p) > 0.2 * mean; });
    if (static_cast<std::size_t>(bright) > few + n / 20) return result;
    for (std::size_t i = 0; i < n; ++i) {
        if (static_cast<double>(power[i]) > 0.02 * mean) result.ids.push_back(static_cast<std::uint16_t>(i));
    }
    if (result.ids.size() > few) {
        std::nth_element(result.ids.begin(), result.ids.begin() + static_cast<std::ptrdiff_t>(few), result.ids.end(),
                         [&](std::uint16_t a, std::uint16_t b) { return power[a] > power[b]; });
        result.ids.resize(few);
        std::sort(result.ids.begin(), result.ids.end());
    }
    for (const std::uint16_t id : result.ids) theirs += static_cast<double>(power[id]);
    result.narrow = static_cast<float>(glm::smoothstep(0.99, 0.998, theirs / std::max(all, 1e-300)));
    return result;
}

// Result: 1 where light comes from so few surfels that all links reversed to them are less than `most`, 0 where they
// are `none` or more.
float few_of(const Links& links, const Brightest& brightest, float most, float none) {
    unsigned each = 0;
    for (const auto& set : links.reversed) each += set->count;
    const float all = static_cast<float>(brightest.ids.size()) * static_cast<float>(each);
    return glm::clamp((none - all) / (none - most), 0.0f, 1.0f);
}

// out += the sum of what is sent over the reversed links of the brightest, those of the first generation and, with the
// weight `few`, of the others. Result: of how many links of each surfel.
float add_reversed(const Links& links, const Brightest& brightest, float few, const std::vector<glm::vec4>& sent,
                   std::vector<glm::vec4>& out, Pool& pool) {
    if (!(brightest.narrow > 0.0f)) return 0.0f;
    constexpr std::size_t kParts = 4;
    std::vector<std::vector<glm::vec4>> sums(kParts);
    std::vector<std::pair<const ReverseLinks*, float>> used;  // and the weight of its links
    float count = 0.0f;
    for (const auto& set : links.reversed) {
        const float weight = brightest.narrow * (used.empty() ? 1.0f : few);
        if (!(weight > 0.0f)) break;
        used.emplace_back(set.get(), weight);
        count += weight * static_cast<float>(set->count);
    }
    pool.run(kParts, [&](int part) {
        std::vector<glm::vec4>& sum = sums[static_cast<std::size_t>(part)];
        sum.assign(out.size(), glm::vec4(0.0f));
        for (std::size_t k = static_cast<std::size_t>(part); k < brightest.ids.size(); k += kParts) {
            const std::size_t j = brightest.ids[k];
            for (const auto& [set, weight] : used) {
                const glm::vec4 value = weight * sent[j];
                for (std::uint32_t at = set->first[j]; at < set->first[j + 1]; ++at) sum[set->from[at]] += value;
            }
        }
    });
    pool.run_chunks(out.size(), kChunk, [&](std::size_t begin, std::size_t size) {
        for (std::size_t i = begin; i < begin + size; ++i) out[i] += sums[0][i] + sums[1][i] + sums[2][i] + sums[3][i];
    });
    return count;
}

double sum_of(const glm::vec4& v) {
    return static_cast<double>(std::abs(v.r) + std::abs(v.g) + std::abs(v.b));
}

}  // namespace

unsigned solve(const Surfels& surfels, const Links& links, std::span<const glm::vec4> exact,
               std::span<const std::uint8_t> seen, const Accuracy& accuracy, Irradiance& light, Pool& pool) {
    const std::size_t n = surfels.count;  // one list of bounces: cut up it would pass ten locals around
    const bool rests = accuracy.change <= kAtRest.change;
    Table table;
    std::vector<glm::vec4> sent, rest(n, glm::vec4(0.0f)), next;
    const auto send = [&](float share, std::span<const glm::vec4> indirect) {
        radiosity(surfels, share, light.direct, indirect, sent, pool);
        make_table(sent, table, pool);
    };
    send(1.0f, {});
    const unsigned there = std::min(links.per_surfel(), accuracy.links);
    const bool reversed = accuracy.links > there && !links.reversed.empty();
    const Brightest brightest = reversed || rests ? brightest_of(surfels, sent, pool) : Brightest();
    light.narrow = brightest.narrow;
    const float few = rests ? 1.0f : few_of(links, brightest, 2.5e6f, 3.5e6f);
    const float more = exact.empty() && reversed ? add_reversed(links, brightest, few, sent, rest, pool) : 0.0f;
    const float exactly = exact.empty() ? 0.0f : brightest.narrow;
    // So many reversed links of the first generation stand for the links that later bounces do not follow.
    const float others = more > 0.0f ? 1.0f - brightest.narrow * (1.0f - few) : 1.0f;
    // The fewer surfels are bright the noisier it is, and the sooner done: time for links that else only rest has.
    const float beyond = rests ? 1.0f : brightest.narrow * few_of(links, brightest, 1e6f, 1.5e6f);
    Followed unseen = kUnseen, shown = kSeen;
    shown.all += static_cast<unsigned>(beyond * static_cast<float>(kMostForwardLinks - shown.all)) / 16 * 16;
    for (Followed* some : {&unseen, &shown})
        some->near = std::min(some->near, there), some->all = std::min(some->all, there);
    if (rests) seen = {};
    // job(first, size, followed) for runs of surfels that follow the same.
    const auto for_all = [&](const auto& job) {
        pool.run_chunks(n, kChunk, [&](std::size_t first, std::size_t size) {
            if (seen.empty()) return job(first, size, shown);
            for (std::size_t i = first, end = i; i < first + size; i = end) {
                while (end < first + size && seen[end] == seen[i]) ++end;
                job(i, end - i, seen[i] != 0 ? shown : unseen);
            }
        });
    };
    // Links that count in the first bounce alone, and the part of it that those of every bounce find.
    const auto first_alone = [&](const Followed& links_of) {
        return others * static_cast<float>(links_of.all - links_of.near) + more;
    };
    const auto near = static_cast<float>(shown.near);
    const float direct = (1.0f - exactly) * near / std::max(near + first_alone(shown), 1.0f);
    for_all([&](std::size_t first, std::size_t size, const Followed& own) {
        const float share = (1.0f - exactly - direct) / std::max(first_alone(own), 1.0f);
        for (std::size_t i = first; i < first + size && brightest.narrow > 0.0f; ++i)
            rest[i] = exact.empty() ? share * rest[i] : exactly * exact[i];
        transfer(links, own.near, own.all, table, others * share, first, size, rest);
        for (std::size_t i = first; i < first + size && !light.haze.empty(); ++i) rest[i] += light.haze[i];
    });
    // One bounce more. out: E.
    const auto bounce_of = [&](std::span<const glm::vec4> indirect, std::vector<glm::vec4>& out) {
        send(direct, indirect);
        out.resize(n);
        for_all([&](std::size_t first, std::size_t size, const Followed& own) {
            std::copy_n(rest.begin() + static_cast<std::ptrdiff_t>(first), size,
                        out.begin() + static_cast<std::ptrdiff_t>(first));
            transfer(links, 0, own.near, table, 1.0f / static_cast<float>(std::max(own.near, 1u)), first, size, out);
        });
    };
    light.converged = false;
    // What rests is solved from the start: it does not depend on what was shown before.
    if (light.indirect.size() != n || rests) {
        bounce_of({}, light.first);
        light.indirect = light.first;
    }
    // E = next, which becomes the change. Result: how much it was, and E, in all.
    const auto take = [&](std::size_t begin, std::size_t count) {
        glm::dvec2 sum(0.0);
        for (std::size_t i = begin; i < begin + count; ++i) {
            const glm::vec4 change = next[i] - light.indirect[i];
            sum += static_cast<double>(surfels.area_m2[i]) * glm::dvec2(sum_of(change), sum_of(next[i]));
            light.indirect[i] = std::exchange(next[i], change);
        }
        return sum;
    };
    double last = 0.0;
    for (unsigned bounce = 1;; ++bounce) {
        bounce_of(light.indirect, next);
        const glm::dvec2 sums = pool.reduce_chunks(n, kChunk, glm::dvec2(0.0), take, std::plus<>());
        const double change = sums.x, sum = sums.y;
        const bool enough = !(change > accuracy.change * sum);
        if (enough || bounce == accuracy.most) {
            light.converged = rests;  // if not yet at the end, another run from the start gets no further
            return bounce;
        }
        // What is still to come falls by the same ratio each time, about: taken in one step, now and then.
        const double ratio = last > 0.0 ? std::min(change / last, 0.99) : 0.0;
        if (ratio > 0.0 && bounce % 3 == 0) {
            const auto ahead = static_cast<float>(ratio / (1.0 - ratio));
            pool.run_chunks(n, kChunk, [&](std::size_t begin, std::size_t count) {
                for (std::size_t i = begin; i < begin + count; ++i)
                    light.indirect[i] = glm::max(light.indirect[i] + next[i] * ahead, glm::vec4(0.0f));
            });
            last = 0.0;
        } else {
            last = change;
        }
    }
}

}  // namespace gonio::transport
#endif
