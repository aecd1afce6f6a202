#include "server/lighting/haze_light.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace gonio::lighting {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr unsigned kSurfelSamples = 4, kPointSamples = 16;  // along a ray

// A surface point, and the directions in which it may see a luminaire's airlight.
struct Facing {
    glm::vec3 point, normal, start, axis, across, up;
    float low, high;   // angles from the luminaire at which it receives any light
    float core = kPi;  // to both sides of `up`, about the luminaire: where a narrow beam is seen
    Facing(const glm::vec3& at, const glm::vec3& facing, const glm::vec3& from, const AirlightSource& source)
        : point(at), normal(facing), start(from) {
        const glm::vec3 to = source.light.position - at;
        const float distance = glm::length(to);
        axis = distance > 0.0f ? to / distance : facing;
        // The beam's own direction, as it is seen.
        const glm::vec3 beam = glm::transpose(source.light.light_from_world) * glm::vec3(0.0f, 0.0f, -1.0f),
                        seen = beam - glm::dot(beam, axis) * axis;
        const float sine = glm::length(seen),
                    core_sine = std::sqrt(std::max(0.0f, 1.0f - source.core_cos * source.core_cos));
        if (source.core_cos > 0.0f && core_sine < 0.99f * sine) {
            up = seen / sine;
            core = std::min(
                kPi, 1.05f * std::asin(core_sine / sine) + 0.02f);  // of the planes through both that touch its cone
        } else {
            up = glm::normalize(glm::cross(axis, std::abs(axis.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0)));
        }
        across = glm::cross(axis, up);
        const float turned = std::acos(std::clamp(glm::dot(axis, facing), -1.0f, 1.0f));
        low = std::max(0.0f, turned - 0.5f * kPi), high = std::min(kPi, turned + 0.5f * kPi);
    }
    // share: 0 … 1 of the angles; turn: about the luminaire, -1 … 1 of those in the core or outside.
    glm::vec3 direction(float share, float turn, bool in_core) const {
        const float angle = low + share * (high - low), about = in_core ? turn * core : kPi + turn * (kPi - core);
        return std::cos(angle) * axis + std::sin(angle) * (std::cos(about) * up + std::sin(about) * across);
    }
    // Of a direction: cosine × the solid angle that it stands for, of one of `count` in the core or outside.
    float weight(const glm::vec3& direction, bool in_core, float count) const {
        const float cosine = glm::dot(direction, axis), sine = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
        return std::max(glm::dot(direction, normal), 0.0f) * 2.0f * (in_core ? core : kPi - core) * sine *
               (high - low) / count;
    }
};
// Of sixteen directions so many look into the core, where there is an outside.
constexpr int kInCore = 12;

// What sixteen directions bring, of `packets` such. share: of direction k, of those that look to where it does; turn:
// likewise, 0 … 1.
template <typename Share, typename Turn>
float sixteen(const Facing& facing, const trace::Geometry& geometry, const AirlightSource& source, float far_m,
              float packets, unsigned samples, Share share, Turn turn, AirRays& scratch) {
    static_assert(trace::kPacket == kSimdWidth);
    trace::RayPacket rays;
    trace::HitPacket hits;
    float weights[kSimdWidth], seen[kSimdWidth];
    unsigned active = 0;
    const int in_core = facing.core < kPi ? kInCore : trace::kPacket;
    for (int k = 0; k < trace::kPacket; ++k) {
        const bool core = k < in_core;
        const int count = core ? in_core : trace::kPacket - in_core, index = core ? k : k - in_core;
        const glm::vec3 direction = facing.direction(share(index, count), 2.0f * turn(k) - 1.0f, core);
        weights[k] = facing.weight(direction, core, static_cast<float>(count) * packets);
        rays.set(k, facing.start, direction);
        if (weights[k] > 0.0f) active |= 1u << k;
    }
    const unsigned met = active != 0 ? geometry.closest(rays, active, hits) : 0;
    for (int k = 0; k < trace::kPacket; ++k) {
        const float far = (active >> k & 1u) == 0 ? 0.0f : (met >> k & 1u) != 0 ? hits.distance[k] : far_m;
        scratch.set(static_cast<std::size_t>(k), facing.point, rays.along(k), far, 0.5f);
    }
    airlight(source, scratch, 0, kSimdWidth, samples, seen);
    float sum = 0.0f;
    for (std::size_t k = 0; k < kSimdWidth; ++k) sum += weights[k] * seen[k];
    return sum;
}

constexpr float kGolden = 0.618034f, kOther = 0.754878f;  // fractions that never repeat
float fraction(float x) {
    return x - std::floor(x);
}

}  // namespace

HazePoints haze_points(const transport::Surfels& surfels, Pool& pool) {
    constexpr float kPatch_radii = 9.5f;  // a side
    constexpr std::size_t kChunk = 256;
    const float side_m = kPatch_radii * surfels.radius_m;
    HazePoints points;
    points.around.resize(surfels.count), points.weights.resize(surfels.count);
    if (surfels.count == 0) return points;
    // A patch is the surfels in one cube that face the same way of six and lie on one surface. Of the walls of a
    // partition one may be lit and the other dark, so a gap along the axis that they face begins another patch. Where
    // surfels crowd near a source, and around there, the cube's side is an eighth, halved as often as their spacing is:
    // on the walls of a housing what haze scatters changes as fast as direct light does.
    constexpr int kNear = 3;
    std::vector<int> levels(surfels.count, 0);
    for (std::size_t i = 0; i < surfels.count; ++i) {
        float least_m = surfels.radius_m;
        for (const std::uint16_t id : surfels.neighbours[i])
            if (id < surfels.count) least_m = std::min(least_m, surfels.spacing_m[id]);
        const float halved = std::log2(surfels.radius_m / std::max(least_m, 1e-6f));
        if (least_m < surfels.radius_m) levels[i] = std::min(kNear + static_cast<int>(halved), 6);
    }
    const auto side_of = [&](std::size_t i) { return std::ldexp(side_m, -levels[i]); };
    struct Patch {
        glm::vec3 sum{0.0f};
        std::vector<std::uint16_t> ids;
        std::uint16_t number = 0;  // of its point
    };
    std::map<std::array<int, 5>, std::vector<std::pair<float, std::uint16_t>>> cubes;  // by place along the axis faced
    for (std::size_t i = 0; i < surfels.count; ++i) {
        const glm::vec3 p = surfels.position(i), n = surfels.normal(i), cell = glm::floor(p / side_of(i)),
                        a = glm::abs(n);
        const int axis = a.x > a.y && a.x > a.z ? 0 : a.y > a.z ? 1 : 2;
        cubes[{static_cast<int>(cell.x), static_cast<int>(cell.y), static_cast<int>(cell.z),
               2 * axis + (n[axis] < 0.0f ? 1 : 0), levels[i]}]
            .emplace_back(p[axis], static_cast<std::uint16_t>(i));
    }
    std::vector<Patch> patches;
    patches.reserve(surfels.count);  // they stay where they are
    std::vector<const Patch*> patch_of(surfels.count);
    for (auto& [key, members] : cubes) {
        std::ranges::sort(members);
        const float gap_m = 0.3f * std::ldexp(surfels.radius_m, -key[4]);
        for (std::size_t k = 0; k < members.size(); ++k) {
            if (k == 0 || members[k].first - members[k - 1].first > gap_m) patches.emplace_back();
            Patch& patch = patches.back();
            patch.sum += surfels.position(members[k].second);
            patch.ids.push_back(members[k].second);
            patch_of[members[k].second] = &patch;
        }
    }
    // Of each patch the surfel that is nearest to its middle.
    for (Patch& patch : patches) {
        const glm::vec3 middle = patch.sum / static_cast<float>(patch.ids.size());
        const auto off = [&](std::uint16_t id) { return glm::distance(surfels.position(id), middle); };
        patch.number = static_cast<std::uint16_t>(points.ids.size());
        points.ids.push_back(
            *std::min_element(patch.ids.begin(), patch.ids.end(), [&](auto a, auto b) { return off(a) < off(b); }));
    }
    // A surfel takes the points of its own patch and of those of its neighbours, which it sees.
    pool.run_chunks(surfels.count, kChunk, [&](std::size_t first, std::size_t size) {
        for (std::size_t i = first; i < first + size; ++i) {
            auto& around = points.around[i];
            auto& weights = points.weights[i];
            std::size_t count = 0;
            const auto add = [&](std::uint16_t point) {
                if (count == HazePoints::kAround ||
                    std::find(around.begin(), around.begin() + count, point) != around.begin() + count)
                    return;
                const std::size_t id = points.ids[point];
                const float off = glm::distance(surfels.position(i), surfels.position(id)) / (1.5f * side_of(i)),
                            near = std::max(0.0f, 1.0f - off * off),
                            facing = std::max(0.0f, glm::dot(surfels.normal(i), surfels.normal(id)));
                around[count] = point, weights[count] = near * near * facing * facing + 1e-6f;
                ++count;
            };
            add(patch_of[i]->number);
            for (const std::uint16_t id : surfels.neighbours[i])
                if (id < surfels.count) add(patch_of[id]->number);
            float all = 0.0f;
            for (std::size_t k = count; k < HazePoints::kAround; ++k) around[k] = around[0], weights[k] = 0.0f;
            for (const float weight : weights) all += weight;
            for (float& weight : weights) weight /= all;
        }
    });
    return points;
}

void haze_at_surfels(const transport::Surfels& surfels, const HazePoints& points, const trace::Geometry& geometry,
                     const AirlightSource& source, float far_m, std::vector<float>& out, Pool& pool) {
    constexpr std::size_t kChunk = 64;
    std::vector<float> found(points.ids.size()), even(points.ids.size());
    pool.run_chunks(points.ids.size(), kChunk, [&](std::size_t first, std::size_t size) {
        AirRays scratch;
        scratch.resize(kSimdWidth);
        for (std::size_t i = first; i < first + size; ++i) {
            const std::size_t id = points.ids[i];
            const glm::vec3 p = surfels.position(id);
            const Facing facing(p, surfels.normal(id), p + surfels.geometric[id] * geometry.step_off(p), source);
            const float own = static_cast<float>(i % 4096), shift = fraction(own * kGolden),
                        turned = fraction(own * kOther);
            found[i] = sixteen(
                facing, geometry, source, far_m, 1.0f, kSurfelSamples,
                [&](int k, int count) { return (static_cast<float>(k) + shift) / static_cast<float>(count); },
                [&](int k) { return fraction(turned + static_cast<float>(k) * kGolden); }, scratch);
        }
    });
    // What sixteen rays tell is noisy: a point takes the mean of the patches around, its own twice.
    const auto mean = [&](const std::vector<float>& from, std::size_t id) {
        float sum = 0.0f;
        for (std::size_t k = 0; k < HazePoints::kAround; ++k) sum += points.weights[id][k] * from[points.around[id][k]];
        return sum;
    };
    for (std::size_t i = 0; i < points.ids.size(); ++i) even[i] = mean(found, points.ids[i]);
    out.resize(surfels.count);
    pool.run_chunks(surfels.count, 16 * kChunk, [&](std::size_t first, std::size_t size) {
        for (std::size_t i = first; i < first + size; ++i) out[i] = mean(even, i);
    });
}

float haze_at_point(const glm::vec3& point, const glm::vec3& normal, const glm::vec3& start,
                    const trace::Geometry& geometry, const AirlightSource& source, float far_m, Pool& pool) {
    constexpr int kPackets = 256;
    const Facing facing(point, normal, start, source);
    std::vector<float> sums(kPackets);
    pool.run(kPackets, [&](int packet) {
        AirRays scratch;
        scratch.resize(kSimdWidth);
        const float own = static_cast<float>(packet);
        sums[static_cast<std::size_t>(packet)] = sixteen(
            facing, geometry, source, far_m, kPackets, kPointSamples,
            [&](int k, int count) {
                return (static_cast<float>(k) + (own + 0.5f) / kPackets) / static_cast<float>(count);
            },
            [&](int k) { return fraction(own * kOther + static_cast<float>(k) * kGolden); }, scratch);
    });
    float sum = 0.0f;
    for (const float one : sums) sum += one;
    return sum;
}

}  // namespace gonio::lighting
