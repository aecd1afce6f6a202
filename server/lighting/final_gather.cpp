#include "server/lighting/final_gather.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/packing.hpp>

namespace gonio::lighting {
namespace {

// Pixels next to something, of which a mean over their links of min(1, pixel / length) is at least the first, are not
// averaged with others, from the second on not at all, and follow as many times more links.
constexpr float kNear = 0.05f, kNearest = 0.15f;
constexpr unsigned kNearLinks = 4;
// Rays traced at a time.
constexpr std::size_t kPart = 32768;

// Which part of a tile's links a pixel follows: neighbours follow parts that are far apart.
unsigned part_of(int x, int y, int tile) {
    constexpr unsigned kFour[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
    constexpr unsigned kTwo[2][2] = {{0, 2}, {3, 1}};
    const unsigned four = kFour[y & 3][x & 3];
    return tile == 4 ? four : 4 * four + kTwo[y >> 2 & 1][x >> 2 & 1];
}

struct Tracer {
    const GBuffer& gbuffer;
    const transport::Transport::Surface& surface;
    const transport::Links& scene_links;
    const FinalGather& gather;
    const float nearby_m;  // links up to here take direct light where they end
    const int y;
    FinalGather::Row& row;

    // Sixteen links of a pixel, `generation` in the tile's sequence. Result: the sum of its rays' nearness.
    float follow(std::size_t x, const Spot& spot, unsigned generation, std::uint16_t* ids, LinkEnds& ends) const {
        const float pixel_m = gbuffer.depth_per_pixel * spot.depth;
        // Depth is not exact, and a seam may be nearer than its error: nothing is between the eye and the pixel.
        const glm::vec3 from = spot.position + spot.normal * (4.0f * surface.geometry->step_off(spot.position)) +
                               glm::normalize(gbuffer.rays.eye - spot.position) * (0.1f * pixel_m);
        const auto parts = static_cast<unsigned>(gather.pass.tile * gather.pass.tile);
        const unsigned packet = generation * parts + part_of(static_cast<int>(x), y, gather.pass.tile);
        const transport::Fan fan = transport::make_fan(from, spot.normal, spot.normal, gather.directions[packet]);
        trace::HitPacket hits;
        const unsigned met = transport::follow(fan, *surface.geometry, surface.surfels, *surface.cells, hits, ids);
        float near = 0.0f;
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((met >> i & 1u) == 0) continue;
            near += std::min(1.0f, pixel_m / std::max(hits.distance[i], 1e-30f));
            if (ids[i] == surface.surfels.count || !(hits.distance[i] < nearby_m)) continue;
            ends.add(fan, hits, i, ids[i], scene_links.passes(ids[i]), static_cast<std::uint32_t>(x));
        }
        return near;
    }

    void trace(std::size_t first, std::size_t count) const {
        static thread_local std::vector<std::uint16_t> ids, more;
        static thread_local LinkEnds ends;
        const auto none = static_cast<std::uint16_t>(surface.surfels.count);
        const unsigned generations = gather.pass.generations, links = generations * trace::kPacket;
        ids.assign(count * links, none);
        ends.clear();
        for (std::size_t x = first; x < first + count; ++x) {
            const Spot spot = row.spots[x] = spot_at(gbuffer, static_cast<int>(x), y);
            row.near[x] = 0.0f;
            if (!(spot.depth > 0.0f)) continue;
            float near = 0.0f;
            for (unsigned k = 0; k < generations; ++k)
                near += follow(x, spot, k, ids.data() + (x - first) * links + k * trace::kPacket, ends);
            row.near[x] = glm::smoothstep(kNear, kNearest, near / static_cast<float>(links));
        }
        for (std::size_t i = 0; i < gather.sources.size(); ++i) {
            const transport::Table& sent = gather.sources[i].sent;
            glm::vec4* own = row.own[i].data() + first;
            std::fill_n(own, count, glm::vec4(0.0f));
            transport::gather(sent, {ids.data(), links, links, count}, sent.unit / static_cast<float>(links), own);
        }
        const unsigned all = kNearLinks * links;
        more.resize(all - links);
        for (std::size_t x = first; x < first + count; ++x) {
            if (!(row.near[x] > 0.0f)) continue;
            for (unsigned k = generations; k < kNearLinks * generations; ++k)
                follow(x, row.spots[x], k, more.data() + (k - generations) * trace::kPacket, ends);
            for (std::size_t i = 0; i < gather.sources.size(); ++i) {
                const transport::Table& sent = gather.sources[i].sent;
                row.own[i][x] /= static_cast<float>(kNearLinks);
                transport::gather(sent, {more.data(), all - links, all - links, 1}, sent.unit / static_cast<float>(all),
                                  &row.own[i][x]);
            }
        }
        for (std::size_t i = 0; i < gather.sources.size(); ++i) {
            if (!gather.sources[i].ends) continue;
            ends.each(surface, *gather.sources[i].ends, [&](std::uint32_t x, const glm::vec3& sent) {
                row.own[i][x] += glm::vec4(sent / static_cast<float>(row.near[x] > 0.0f ? all : links), 0.0f);
            });
        }
    }
};

// out[x]: the mean over the tile around a pixel of row y, of what lies on its plane and faces its way.
void average(const FinalGather& gather, const GBuffer& gbuffer, int y, std::size_t x,
             std::vector<std::vector<glm::vec4>>& out) {
    constexpr float kFacing = 0.97f;  // cosine
    const int reach = gather.pass.tile / 2;
    const auto row_at = [&](int v) -> const FinalGather::Row& {
        return gather.rows[static_cast<std::size_t>(v) % gather.rows.size()];
    };
    const FinalGather::Row& own = row_at(y);
    const Spot& spot = own.spots[x];
    const float near = own.near[x];
    for (std::size_t i = 0; i < out.size(); ++i) out[i][x] = own.own[i][x] * near;
    if (!(near < 1.0f) || !(spot.depth > 0.0f)) return;
    const float off_m = gbuffer.depth_per_pixel * spot.depth;
    struct Tap {
        int v;
        std::size_t u;
        float weight;
    } taps[81];
    int count = 0;
    float total = 0.0f;
    for (int v = std::max(y - reach, 0); v <= std::min(y + reach, gbuffer.height - 1); ++v) {
        for (int u = std::max(static_cast<int>(x) - reach, 0);
             u <= std::min(static_cast<int>(x) + reach, gbuffer.width - 1); ++u) {
            const Spot& other = row_at(v).spots[static_cast<std::size_t>(u)];
            if (!(other.depth > 0.0f) || glm::dot(other.normal, spot.normal) < kFacing ||
                std::abs(glm::dot(other.position - spot.position, spot.normal)) > off_m)
                continue;
            // Those of both edges follow the same links.
            const float weight =
                (std::abs(u - static_cast<int>(x)) == reach ? 0.5f : 1.0f) * (std::abs(v - y) == reach ? 0.5f : 1.0f);
            taps[count++] = {v, static_cast<std::size_t>(u), weight};
            total += weight;
        }
    }
    for (std::size_t i = 0; i < out.size(); ++i) {
        glm::vec4 sum(0.0f);
        for (int k = 0; k < count; ++k) sum += row_at(taps[k].v).own[i][taps[k].u] * taps[k].weight;
        out[i][x] += sum * ((1.0f - near) / total);
    }
}

}  // namespace

bool continue_gather(const GBuffer& gbuffer, const ScreenGrid& screen, const transport::Transport& transport,
                     FinalGather& gather, const std::function<void(std::size_t, int, std::span<const glm::vec4>)>& done,
                     Pool& pool) {
    constexpr std::size_t kChunk = 32;
    const auto width = static_cast<std::size_t>(gbuffer.width);
    const int reach = gather.pass.tile / 2;
    if (gather.rows.empty()) {
        const auto packets =
            kNearLinks * gather.pass.generations * static_cast<unsigned>(gather.pass.tile * gather.pass.tile);
        for (unsigned k = 0; k < packets; ++k)
            gather.directions.push_back(transport::fan_directions(0, k * trace::kPacket));
        gather.rows.resize(static_cast<std::size_t>(gather.pass.tile) + 1);
        for (FinalGather::Row& row : gather.rows) {
            row.spots.resize(width);
            row.near.resize(width);
            row.own.assign(gather.sources.size(), std::vector<glm::vec4>(width));
        }
    }
    if (gather.next < gbuffer.height) {
        float radii = 0.0f;
        for (const GatherSource& source : gather.sources) {
            if (source.ends) radii = std::max(radii, source.ends->narrow > 0.0f ? kVplsAloneRadii : kExactRadii);
        }
        const Tracer tracer{gbuffer,
                            *transport.surface,
                            transport.links,
                            gather,
                            radii * transport.surface->surfels.radius_m,
                            gather.next,
                            gather.rows[static_cast<std::size_t>(gather.next) % gather.rows.size()]};
        const std::size_t part = kPart / (gather.pass.generations * trace::kPacket) / kChunk * kChunk,
                          first = gather.next_x, end = std::min(first + part, width);
        pool.run_chunks(end - first, kChunk,
                        [&](std::size_t begin, std::size_t count) { tracer.trace(first + begin, count); });
        gather.next_x = end;
        if (end < width) return false;
        gather.next_x = 0;
    }
    const int y = gather.next - reach;
    if (y >= 0 && y < gbuffer.height) {
        std::vector<std::vector<glm::vec4>> values(gather.sources.size(), std::vector<glm::vec4>(width));
        pool.run_chunks(width, kChunk, [&](std::size_t first, std::size_t count) {
            for (std::size_t x = first; x < first + count; ++x) average(gather, gbuffer, y, x, values);
        });
        std::vector<std::uint16_t> halves;
        for (std::size_t i = 0; i < values.size(); ++i) {
            if (!gather.sources[i].besides.empty()) {
                halves.resize(4 * gbuffer.row_length);
                upsample_line(gbuffer, screen, gather.sources[i].besides, y, halves.data());
                for (std::size_t x = 0; x < width; ++x) {
                    for (int k = 0; k < 3; ++k)
                        values[i][x][k] += glm::unpackHalf1x16(halves[4 * x + static_cast<std::size_t>(k)]);
                }
            }
            done(i, y, values[i]);
        }
    }
    return ++gather.next >= gbuffer.height + reach;
}

}  // namespace gonio::lighting
