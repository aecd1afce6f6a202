#include "server/transport/solve.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/transport/solve.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::transport {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The four values of an entry are one vector, or, without vectors, four of one lane each.
using Four = hn::CappedTag<float, 4>;
using FourHalves = hn::Rebind<hwy::float16_t, Four>;
constexpr std::size_t kStep = HWY_TARGET == HWY_SCALAR ? 1 : 4;

HWY_INLINE hn::Vec<Four> entry(const std::uint16_t* halves, std::uint16_t id) {
    return hn::PromoteTo(Four(), hn::LoadU(FourHalves(), reinterpret_cast<const hwy::float16_t*>(halves) +
                                                             4 * static_cast<std::size_t>(id)));
}

void Gather(const std::uint16_t* table, const std::uint16_t* ids, unsigned count, std::size_t size, float share,
            glm::vec4* sums) {
    const Four four;
    for (std::size_t i = 0; i < size; ++i, ids += count) {
        for (std::size_t lane = 0; lane < 4; lane += kStep) {
            auto a = hn::Zero(four), b = a, c = a, d = a;
            for (unsigned k = 0; k < count; k += 4) {
                a = hn::Add(a, entry(table + lane, ids[k]));
                b = hn::Add(b, entry(table + lane, ids[k + 1]));
                c = hn::Add(c, entry(table + lane, ids[k + 2]));
                d = hn::Add(d, entry(table + lane, ids[k + 3]));
            }
            float* to = &sums[i][0] + lane;
            hn::StoreU(hn::MulAdd(hn::Add(hn::Add(a, b), hn::Add(c, d)), hn::Set(four, share), hn::LoadU(four, to)),
                       four, to);
        }
    }
}

void Blend(const std::uint16_t* table, const std::uint16_t* const* ids, const float* weights, std::size_t size,
           float unit, glm::vec4* out) {
    const Four four;
    for (std::size_t i = 0; i < size; ++i, weights += kNeighbours) {
        for (std::size_t lane = 0; lane < 4; lane += kStep) {
            auto a = hn::Zero(four), b = a;
            if (const std::uint16_t* own = ids[i]) {
                for (std::size_t k = 0; k < kNeighbours; k += 2) {
                    a = hn::MulAdd(entry(table + lane, own[k]), hn::Set(four, weights[k]), a);
                    b = hn::MulAdd(entry(table + lane, own[k + 1]), hn::Set(four, weights[k + 1]), b);
                }
            }
            hn::StoreU(hn::Mul(hn::Add(a, b), hn::Set(four, unit)), four, &out[i][0] + lane);
        }
    }
}

void Halve(const glm::vec4* values, std::size_t size, float factor, std::uint16_t* halves) {
    const Four four;
    for (std::size_t i = 0; i < size; ++i) {
        for (std::size_t lane = 0; lane < 4; lane += kStep)
            hn::StoreU(hn::DemoteTo(FourHalves(), hn::Mul(hn::LoadU(four, &values[i][0] + lane), hn::Set(four, factor))),
                       FourHalves(), reinterpret_cast<hwy::float16_t*>(halves) + 4 * i + lane);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::transport
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::transport {

HWY_EXPORT(Gather);
HWY_EXPORT(Blend);
HWY_EXPORT(Halve);

namespace {

constexpr float kGreatest = 1000.0f;
constexpr std::size_t kChunk = 1024;  // surfels a job
// Later bounces are smooth: they follow this many of the links.
constexpr unsigned kLaterLinks = 128;

}  // namespace

void gather(const Table& table, const std::uint16_t* ids, unsigned count, std::size_t size, float share,
            glm::vec4* sums) {
    HWY_DYNAMIC_DISPATCH(Gather)(table.halves.data(), ids, count, size, share, sums);
}

void blend(const Table& table, const std::uint16_t* const* ids, const float* weights, std::size_t size,
           glm::vec4* out) {
    HWY_DYNAMIC_DISPATCH(Blend)(table.halves.data(), ids, weights, size, table.unit, out);
}

void make_table(std::span<const glm::vec4> values, Table& table, Pool& pool) {
    std::vector<float> greatest((values.size() + kChunk - 1) / kChunk, 0.0f);
    pool.run_chunks(values.size(), kChunk, [&](std::size_t first, std::size_t count) {
        float most = 0.0f;
        for (std::size_t i = first; i < first + count; ++i)
            most = std::max({most, values[i].r, values[i].g, values[i].b});
        greatest[first / kChunk] = most;
    });
    const float most = values.empty() ? 0.0f : *std::max_element(greatest.begin(), greatest.end());
    table.halves.assign((values.size() + 1) * 4, 0);
    table.unit = std::isfinite(most) && most > 0.0f ? most / kGreatest : 0.0f;
    if (!(table.unit > 0.0f)) return;
    pool.run_chunks(values.size(), kChunk, [&](std::size_t first, std::size_t count) {
        HWY_DYNAMIC_DISPATCH(Halve)(values.data() + first, count, 1.0f / table.unit, table.halves.data() + 4 * first);
    });
}

void radiosity(const Surfels& surfels, const Irradiance& light, std::span<const glm::vec4> emission,
               std::vector<glm::vec4>& out, Pool& pool) {
    out.resize(surfels.count);
    pool.run_chunks(surfels.count, kChunk, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i) {
            glm::vec4 sum = light.direct.empty() ? glm::vec4(0.0f) : light.direct[i];
            if (!light.indirect.empty()) sum += light.indirect[i];
            out[i] = glm::vec4(surfels.albedo[i], 0.0f) * sum;
            if (!emission.empty()) out[i] += emission[i];
        }
    });
}

namespace {

// out = the mean over each surfel's links of what the table holds, with at most that many links.
void transfer(const Links& links, const Table& table, unsigned most, std::vector<glm::vec4>& out, Pool& pool) {
    std::fill(out.begin(), out.end(), glm::vec4(0.0f));
    if (!(table.unit > 0.0f) || links.blocks.empty()) return;
    float weight = 0.0f;
    std::vector<const LinkBlock*> used;
    for (const auto& block : links.blocks) {
        if (block->first > 0 && block->first + block->count > most) break;
        used.push_back(block.get());
        weight += static_cast<float>(block->count);
    }
    pool.run_chunks(out.size(), kChunk, [&](std::size_t first, std::size_t count) {
        for (const LinkBlock* block : used)
            gather(table, block->ids.data() + first * block->count, block->count, count, table.unit / weight,
                   out.data() + first);
    });
}

// Where the brightest tenth of the surfels sends all but a five-hundredth of the light, the mean of `out` over the
// links becomes one over the reversed ones too; up to a fiftieth, in part.
void add_reversed(const Surfels& surfels, const Links& links, const std::vector<glm::vec4>& sent,
                  std::vector<glm::vec4>& out, Pool& pool) {
    if (links.reversed.empty()) return;
    const std::size_t n = surfels.count, few = n / 10;
    const auto power = [&](std::size_t i) {
        return surfels.area_m2[i] * (0.2126f * sent[i].r + 0.7152f * sent[i].g + 0.0722f * sent[i].b);
    };
    std::vector<std::pair<float, std::uint16_t>> by_power(n);
    double all = 0.0, theirs = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        by_power[i] = {power(i), static_cast<std::uint16_t>(i)};
        all += static_cast<double>(by_power[i].first);
    }
    std::nth_element(by_power.begin(), by_power.begin() + static_cast<std::ptrdiff_t>(few), by_power.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    by_power.resize(few);
    // Those that send next to nothing are left out too.
    std::erase_if(by_power, [&](const auto& one) { return !(static_cast<double>(one.first) * static_cast<double>(n) > 1e-4 * all); });
    for (const auto& one : by_power) theirs += static_cast<double>(one.first);
    const double x = std::clamp((theirs / std::max(all, 1e-300) - 0.98) / (0.998 - 0.98), 0.0, 1.0),
                 weight = x * x * (3.0 - 2.0 * x);
    if (!(weight > 0.0)) return;

    constexpr std::size_t kParts = 4;
    std::vector<std::vector<glm::vec4>> sums(kParts);
    unsigned more = 0;
    for (const auto& block : links.reversed) more += block->count;
    pool.run(kParts, [&](int part) {
        std::vector<glm::vec4>& sum = sums[static_cast<std::size_t>(part)];
        sum.assign(n, glm::vec4(0.0f));
        for (std::size_t k = static_cast<std::size_t>(part); k < by_power.size(); k += kParts) {
            const std::size_t j = by_power[k].second;
            const glm::vec4 value = sent[j];
            for (const auto& block : links.reversed) {
                for (std::uint32_t at = block->first[j]; at < block->first[j + 1]; ++at) sum[block->from[at]] += value;
            }
        }
    });
    const auto count = static_cast<float>(links.per_surfel()), extra = static_cast<float>(weight) * static_cast<float>(more);
    pool.run_chunks(n, kChunk, [&](std::size_t begin, std::size_t size) {
        for (std::size_t i = begin; i < begin + size; ++i) {
            const glm::vec4 sum = sums[0][i] + sums[1][i] + sums[2][i] + sums[3][i];
            out[i] = (out[i] * count + sum * static_cast<float>(weight)) / (count + extra);
        }
    });
}

double sum_of(const glm::vec4& v) {
    return static_cast<double>(std::abs(v.r) + std::abs(v.g) + std::abs(v.b));
}

}  // namespace

unsigned solve(const Surfels& surfels, const Links& links, std::span<const glm::vec4> emission, const Accuracy& accuracy,
               Irradiance& light, Pool& pool) {
    const std::size_t n = surfels.count;
    Table table;
    std::vector<glm::vec4> sent(n), first(n), next(n);
    // The first bounce follows all links; what comes after it is smoother.
    const Irradiance once{light.direct, {}, false};
    radiosity(surfels, once, emission, sent, pool);
    make_table(sent, table, pool);
    transfer(links, table, ~0u, first, pool);
    add_reversed(surfels, links, sent, first, pool);
    light.converged = false;
    const bool cold = light.indirect.size() != n;
    if (cold) light.indirect = first;
    std::vector<double> changes((n + kChunk - 1) / kChunk), sums(changes.size());
    double last = 0.0;
    for (unsigned bounce = 1;; ++bounce) {
        pool.run_chunks(n, kChunk, [&](std::size_t begin, std::size_t count) {
            for (std::size_t i = begin; i < begin + count; ++i)
                sent[i] = glm::vec4(surfels.albedo[i], 0.0f) * light.indirect[i];
        });
        make_table(sent, table, pool);
        transfer(links, table, kLaterLinks, next, pool);
        pool.run_chunks(n, kChunk, [&](std::size_t begin, std::size_t count) {
            double change = 0.0, sum = 0.0;
            for (std::size_t i = begin; i < begin + count; ++i) {
                const glm::vec4 value = first[i] + next[i];
                change += static_cast<double>(surfels.area_m2[i]) * sum_of(value - light.indirect[i]);
                sum += static_cast<double>(surfels.area_m2[i]) * sum_of(value);
                next[i] = value - light.indirect[i];
                light.indirect[i] = value;
            }
            changes[begin / kChunk] = change;
            sums[begin / kChunk] = sum;
        });
        double change = 0.0, sum = 0.0;
        for (std::size_t c = 0; c < changes.size(); ++c) change += changes[c], sum += sums[c];
        const bool enough = !(change > accuracy.change * sum);
        if (enough || bounce == accuracy.most) {
            light.converged = enough && accuracy.change <= kAtRest.change;
            return bounce;
        }
        // What is still to come falls by the same ratio each time, about: taken in one step, now and then.
        const double ratio = last > 0.0 ? std::min(change / last, 0.95) : 0.0;
        if (ratio > 0.0 && bounce % 3 == 0) {
            const auto more = static_cast<float>(ratio / (1.0 - ratio));
            pool.run_chunks(n, kChunk, [&](std::size_t begin, std::size_t count) {
                for (std::size_t i = begin; i < begin + count; ++i)
                    light.indirect[i] = glm::max(light.indirect[i] + next[i] * more, glm::vec4(0.0f));
            });
            last = 0.0;
        } else {
            last = change;
        }
    }
}

}  // namespace gonio::transport
#endif
