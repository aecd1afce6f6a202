#include "server/transport/transport.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <tuple>

#include "server/trace/path.h"

namespace gonio::transport {

namespace {

// Direct illuminance of emissive surfaces at the surfels, lux: by the reference's own estimator.
std::vector<glm::vec4> lit_by_emitters(const Surfels& surfels, const trace::World& world, Pool& pool,
                                       const std::function<bool()>& stopped) {
    constexpr std::uint32_t kSamples = 64;
    constexpr std::size_t kChunk = 64;
    std::vector<glm::vec4> lit(surfels.count, glm::vec4(0.0f));
    pool.run_chunks(surfels.count, kChunk, [&](std::size_t first, std::size_t count) {
        if (stopped()) return;
        for (std::size_t i = first; i < first + count; ++i) {
            const trace::Receiver at = trace::receiver_of(*world.geometry, surfels.at(i));
            for (std::uint32_t k = 0; k < kSamples; ++k) {
                trace::Sample sample(static_cast<std::uint32_t>(i), k);
                const glm::vec3 found = trace::trace_path(world, at, 0, sample).direct;
                if (std::isfinite(found.r + found.g + found.b)) lit[i] += glm::vec4(found, 0.0f);
            }
            lit[i] /= static_cast<float>(kSamples);
        }
    });
    return lit;
}

// As many surfels as fit beside the cells, a few if there is no room.
SurfelSettings within_bytes(SurfelSettings settings, const trace::Geometry& geometry, bool table) {
    constexpr std::size_t kFewest = 1000;
    // Links and, of those kept in reverse, where they start; points, means, neighbours; darts may pack more densely.
    constexpr std::size_t kEach = (sizeof(std::uint16_t) * kMostLinks + 256) * 11 / 10;
    const std::size_t cells = std::max(
        settings.bytes / 4, geometry.asset().triangles() * (CellMap::kLeastBytesPerTriangle + (table ? 12 : 0)));
    const std::size_t room = settings.bytes > cells ? (settings.bytes - cells) / kEach : 0;
    settings.most = std::clamp(room, kFewest, settings.most);
    settings.least = std::min(settings.least, settings.most);
    return settings;
}

// What emissive surfaces light is reached from before them. Where there are many, from one in each part of the scene,
// so that few closed rooms are left out.
void add_seeds(const trace::World& world, std::vector<glm::vec3>& seeds) {
    constexpr std::size_t kMost = 512;
    constexpr float kParts = 25.0f;  // along each half of the scene
    std::set<std::tuple<int, int, int>> known;
    for (const trace::Emitter& emitter : world.emitters.list) {
        if (known.size() >= kMost) break;
        const glm::vec3 middle = (emitter.corner[0] + emitter.corner[1] + emitter.corner[2]) / 3.0f,
                        off = emitter.normal * (4.0f * world.geometry->step_off(middle));
        const glm::ivec3 part(glm::floor(middle / world.geometry->extent() * kParts));
        if (!known.emplace(part.x, part.y, part.z).second) continue;
        seeds.push_back(middle + off);
        if (emitter.double_sided) seeds.push_back(middle - off);
    }
}

// Result: the least number of links, no less than these, that a transport is published with. Whoever waited for another
// number would wait for ever.
unsigned published_links(unsigned links) {
    for (const unsigned generation : kGenerations)
        if (links <= generation) return generation;
    return kMostLinks;
}

}  // namespace

std::size_t Transport::bytes() const {
    const Surfels& s = surface->surfels;
    std::size_t sum = surface->cells->bytes() + s.count * (14 * sizeof(float) + 2 * sizeof(glm::vec3) + sizeof(float) +
                                                           sizeof(s.neighbours[0]) + 2 * sizeof(std::uint32_t));
    for (const auto& set : links.sets) sum += set->ids.size() * sizeof(std::uint16_t);
    for (const auto& set : links.reversed)
        sum += set->from.size() * sizeof(std::uint16_t) + set->first.size() * sizeof(std::uint32_t);
    if (links.crowded) {
        const CrowdedLinks& crowded = *links.crowded;
        sum +=
            crowded.to.size() * (sizeof(std::uint16_t) + sizeof(float)) + crowded.first.size() * sizeof(std::uint32_t);
    }
    if (cells) sum += cells->triangles.size() * sizeof(glm::uvec2) + cells->cells.size() * sizeof(std::uint16_t);
    return sum + met_m2.size() * sizeof(float) + 3 * emitted.direct.size() * sizeof(glm::vec4);
}

Transport in_air(const Transport& transport, const Haze& absorption, Pool& pool) {
    Transport result = transport;
    const Surfels& surfels = result.surface->surfels;
    result.links.passed = passed_along_links(result.links, surfels, absorption, pool);
    if (result.emitted.direct.empty()) return result;
    for (std::size_t i = 0; i < surfels.count; ++i) result.emitted.direct[i] *= result.links.passed[i];
    solve_to_the_end(surfels, result.links, result.emitted, pool);
    result.emitted.narrow = 0.0f;  // nothing is drawn from where it shines
    return result;
}

Builder::Builder(std::shared_ptr<const trace::Geometry> geometry, std::vector<glm::vec3> seeds,
                 const SurfelSettings& settings, unsigned links, bool beside, bool cells)
    : wanted_(published_links(links)),
      thread_([this, geometry = std::move(geometry), seeds = std::move(seeds), settings, beside, cells]() mutable {
          make(std::move(geometry), std::move(seeds), settings, beside, cells);
          made_ = ~0u;  // all there can be
          made_.notify_all();
      }) {}

Builder::~Builder() {
    stopped_ = true;
    hold(false);
    ++wanted_;
    wanted_.notify_all();
}

void Builder::want(unsigned links) {
    links = published_links(links);
    if (links <= wanted_) return;
    wanted_ = links;
    wanted_.notify_all();
}

void Builder::wait() {
    for (unsigned made = made_; made < wanted_; made = made_) made_.wait(made);
}

void Builder::hold(bool held) {
    held_ = held;
    held_.notify_all();
}

bool Builder::stopped() const {
    held_.wait(true);
    return stopped_.load(std::memory_order_relaxed);
}

bool Builder::wanted(unsigned links) {
    for (unsigned wanted = wanted_; wanted < links; wanted = wanted_) {
        if (stopped_) return false;
        wanted_.wait(wanted);
    }
    return !stopped();
}

void Builder::make(std::shared_ptr<const trace::Geometry> geometry, std::vector<glm::vec3> seeds,
                   const SurfelSettings& settings, bool beside, bool cells) {
    // Of a machine that is busy the first links get a fifth (weights of nice 6 and 0: 272 and 1024), those after them a
    // tenth (nice 10: 110), as does what waits for them; SCHED_IDLE gets nothing.
    if (beside) setpriority(PRIO_PROCESS, 0, 6);  // Linux: this thread and those that it starts
    if (stopped()) return;
    const auto began = std::chrono::steady_clock::now();
    std::optional<Pool> pool(std::in_place);  // of this one's priority
    const std::function<bool()> ends = [this] { return stopped(); };
    static std::atomic<std::uint64_t> surfaces = 0;
    auto surface = std::make_shared<Transport::Surface>();
    surface->number = ++surfaces;
    surface->geometry = geometry;
    surface->emitters = {geometry, {}, {}, trace::emitters_of(*geometry)};
    const std::size_t sources = seeds.size();
    add_seeds(surface->emitters, seeds);
    surface->surfels = place_surfels(*geometry, seeds, sources, within_bytes(settings, *geometry, cells), *pool, ends);
    const Surfels& surfels = surface->surfels;
    if (stopped()) return;
    surface->cells = std::make_unique<const CellMap>(*geometry, surfels,
                                                     settings.bytes / (cells ? 6 : 4));  // a table is half as large
    Irradiance emitted;
    if (!surface->emitters.emitters.empty()) emitted.direct = lit_by_emitters(surfels, surface->emitters, *pool, ends);
    Links links;
    std::vector<float> met_m2;
    unsigned first = 0, published = 0;
    const auto trace_to = [&](unsigned last) {
        auto set = trace_links(*geometry, surfels, *surface->cells, first, last - first, *pool, ends);
        if (set) first = last;
        return set;
    };
    const auto publish = [&] {
        if (published != first) {
            published = first;
            if (links.reversed.empty()) {  // reversed links add nothing to these
                met_m2 = met_areas_m2(links, surfels);
                links.crowded = std::make_shared<const CrowdedLinks>(crowded_links(links, surfels, met_m2));
            }
            const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - began;
            if (!emitted.direct.empty()) solve_to_the_end(surfels, links, emitted, *pool, ends);
            emitted.narrow = 0.0f;  // nothing is drawn from where it shines
            std::shared_ptr<const CellMap::Table> table;
            if (cells) table = std::make_shared<const CellMap::Table>(surface->cells->table(*pool));
            newest_.store(
                std::make_shared<const Transport>(Transport{surface, links, met_m2, emitted, spent.count(), table}));
        }
        made_ = first;
        made_.notify_all();
    };
    // Each that is published makes every light anew: the first, all but the reversed ones, all.
    for (const unsigned last : kGenerations) {
        if (wanted_ < last) publish();
        if (!wanted(last)) return;
        auto set = trace_to(last);
        if (!set) return;
        if (last == kGenerations[1])  // rows of few ids take longer
            set = join(*std::exchange(links.sets, {})[0], *set, surfels.count);
        links.sets.push_back(std::move(set));
        if (last != kGenerations[0]) continue;
        publish();
        if (beside) setpriority(PRIO_PROCESS, 0, 10);
        pool.emplace();
    }
    publish();
    for (const unsigned last : kReverseGenerations) {
        if (!wanted(last)) return;
        const auto set = trace_to(last);
        if (!set) return;
        links.reversed.push_back(std::make_shared<const ReverseLinks>(reverse(*set, surfels.count)));
    }
    publish();
}

bool reaches(const Transport& transport, const glm::vec3& point) {
    const Transport::Surface& surface = *transport.surface;
    constexpr unsigned kRays = 4 * trace::kPacket;  // half about +Y, half about −Y
    unsigned met = 0, known = 0;
    trace::HitPacket hits;
    std::uint16_t ids[trace::kPacket];
    for (unsigned first = 0; first < kRays; first += trace::kPacket) {
        const glm::vec3 up(0.0f, first < kRays / 2 ? 1.0f : -1.0f, 0.0f);
        const unsigned found = follow(make_fan(point, up, up, fan_directions(7, first)), *surface.geometry,
                                      surface.surfels, *surface.cells, hits, ids);
        for (unsigned i = 0; i < trace::kPacket; ++i) {
            met += found >> i & 1u;
            known += (found >> i & 1u) != 0 && ids[i] != surface.surfels.count ? 1u : 0u;
        }
    }
    return 8 * (met - known) <= met;
}

}  // namespace gonio::transport
