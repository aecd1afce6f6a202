#include "server/bake/validity.h"

#include <algorithm>
#include <map>

#include "server/trace/parallel.h"
#include "server/trace/sampler.h"

namespace gonio::bake {
namespace {

constexpr int kFirst = 32;          // directions after which a texel that met no back is outside
constexpr int kValidityTile = 256;  // texels of one job

bool is_solid(const trace::Geometry& geometry, int instance) {
    const Instance& placed = geometry.asset().instances[static_cast<std::size_t>(instance)];
    const Mesh& mesh = geometry.asset().meshes[static_cast<std::size_t>(placed.mesh)];
    const Material& material = geometry.asset().materials[static_cast<std::size_t>(mesh.material)];
    if (material.double_sided || material.alpha_mask || material.transmissive()) return false;
    const std::vector<int> weld = welded(geometry, instance);
    std::map<std::pair<int, int>, std::pair<int, std::uint32_t>> edges;  // as it runs -> how often, a vertex
    double six_volumes = 0.0, size = 0.0;
    const auto positions = geometry.positions(instance);
    const glm::dvec3 first(positions[mesh.indices.front()]);
    for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
        const auto corner = corners_of(geometry, {instance, static_cast<int>(t / 3), false});
        six_volumes += glm::dot(corner[0] - first, glm::cross(corner[1] - first, corner[2] - first));
        for (std::size_t k = 0; k < 3; ++k) {
            size = std::max(size, glm::length(corner[k] - first));
            const int a = weld[mesh.indices[t + k]], b = weld[mesh.indices[t + (k + 1) % 3]];
            if (a == b) continue;
            auto& [times, vertex] = edges[{a, b}];
            ++times;
            vertex = mesh.indices[t + k];
        }
    }
    // Edges that no triangle runs along the other way: the rim. It must lie in a plane, whose cap adds to the volume.
    std::vector<glm::dvec3> rim;
    std::vector<std::pair<glm::dvec3, glm::dvec3>> gaps;
    std::map<int, glm::dvec3> place;
    for (std::size_t i = 0; i < weld.size(); ++i) place.emplace(weld[i], glm::dvec3(positions[i]));
    for (const auto& [edge, found] : edges) {
        const auto back = edges.find({edge.second, edge.first});
        const int missing = found.first - (back == edges.end() ? 0 : back->second.first);
        if (missing < 0) continue;
        if (missing > 1) return false;
        if (missing == 1) gaps.emplace_back(place[edge.first], place[edge.second]);
    }
    if (!gaps.empty()) {
        glm::dvec3 normal(0.0);
        const glm::dvec3 base = gaps.front().first;
        for (const auto& [a, b] : gaps) normal += glm::cross(b - base, a - base);  // of the cap, outwards
        const double twice = glm::length(normal);
        if (!(twice > 1e-9 * size * size)) return false;
        for (const auto& [a, b] : gaps) {
            if (std::abs(glm::dot(a - base, normal / twice)) > 1e-4 * size) return false;
            six_volumes += glm::dot(base - first, glm::cross(b - first, a - first));
        }
    }
    return six_volumes > 1e-6 * size * size * size;
}

int backs_met(const trace::Geometry& geometry, const std::vector<char>& solids, const Texel& texel, int first,
              int end) {
    const glm::vec3 from = texel.position + texel.geometric * geometry.step_off(texel.position);
    int backs = 0;
    for (int start = first; start < end; start += trace::kPacket) {
        trace::RayPacket rays;
        trace::HitPacket hits;
        unsigned active = 0;
        for (int i = 0; i < trace::kPacket; ++i) {
            trace::Sample sample(0x5eedu, static_cast<std::uint32_t>(start + i));
            const glm::vec3 direction = trace::around(texel.geometric, trace::cosine_hemisphere(sample.next()));
            rays.set(i, from, direction);
            active |= 1u << i;
        }
        const unsigned met = geometry.closest(rays, active, hits);
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((met >> i & 1u) != 0 && solids[hits.instance[i]] != 0 && glm::dot(hits.normal(i), rays.along(i)) > 0.0f)
                ++backs;
        }
    }
    return backs;
}

}  // namespace

std::vector<char> solids_of(const trace::Geometry& geometry) {
    std::vector<char> solids;
    for (std::size_t i = 0; i < geometry.asset().instances.size(); ++i)
        solids.push_back(is_solid(geometry, static_cast<int>(i)) ? 1 : 0);
    return solids;
}

bool is_inside(const trace::Geometry& geometry, const std::vector<char>& solids, const Texel& texel) {
    int backs = backs_met(geometry, solids, texel, 0, kFirst);
    if (backs == 0) return false;
    backs += backs_met(geometry, solids, texel, kFirst, kBackDirections);
    return backs > kMostBacks * kBackDirections;
}

bool find_invalid(Atlas& atlas, const trace::Geometry& geometry, int threads, const std::stop_token& stop) {
    const std::vector<char> solids = solids_of(geometry);
    if (std::none_of(solids.begin(), solids.end(), [](char solid) { return solid != 0; })) return true;
    const auto count = static_cast<int>(atlas.texels.size());
    return trace::parallel((count + kValidityTile - 1) / kValidityTile, threads, false, stop, [&](int tile) {
        for (int i = tile * kValidityTile; i < std::min(count, (tile + 1) * kValidityTile); ++i) {
            Texel& texel = atlas.texels[static_cast<std::size_t>(i)];
            if (texel.valid && is_inside(geometry, solids, texel)) texel.valid = false;
        }
    });
}

}  // namespace gonio::bake
