#include "server/shade/occlusion.h"

#include <algorithm>

namespace gonio::shade {

VplQuery::VplQuery(const PointPacket& points, unsigned active) : points_(points), active_(active) {
    for (int i = 0; i < trace::kPacket; ++i) {
        rays_.from_x[i] = points.array[0][i], rays_.from_y[i] = points.array[1][i],
        rays_.from_z[i] = points.array[2][i];
        rays_.far[i] = 1.0f;
    }
}

void VplQuery::ask(const LightView& light, const Vpl& vpl, const float* brings, float weight) {
    unsigned lit = 0;
    for (int i = 0; i < trace::kPacket; ++i) lit |= (brings[i] > 0.0f ? 1u : 0u) << i;
    lit &= active_;
    if (lit == 0) return;
    const glm::vec3 p = glm::vec3(light.position) + glm::vec3(vpl.position_area);
    const glm::vec3 to = p + glm::vec3(vpl.normal) * (4.0f * light.geometry.step_off(p));
    for (int i = 0; i < trace::kPacket; ++i) {
        rays_.along_x[i] = to.x - rays_.from_x[i], rays_.along_y[i] = to.y - rays_.from_y[i],
        rays_.along_z[i] = to.z - rays_.from_z[i];
    }
    const unsigned stopped = light.geometry.occluded(rays_, lit);
    for (int i = 0; i < trace::kPacket; ++i) {
        open_[i] += weight * brings[i];
        if ((stopped >> i & 1u) != 0) blocked_[i] += weight * brings[i];
    }
}

int asking_nodes(const ScreenGrid& screen) {
    return (screen.nodes.width + 7) / 8 * ((screen.nodes.height + 7) / 8) * 4;
}

AskingNodes asking_nodes_at(const ScreenGrid& screen, const VplCast& cast, int number) {
    const Grid& nodes = screen.nodes;
    const int parity = number % 4, blocks_x = (nodes.width + 7) / 8, block_x = number / 4 % blocks_x * 8,
              block_y = number / 4 / blocks_x * 8;
    AskingNodes result;
    Patch& patch = result.nodes;
    for (int i = 0; i < trace::kPacket; ++i) {
        const int x = block_x + i % 4 * 2 + parity % 2, y = block_y + i / 4 * 2 + parity / 2;
        patch.at[i] = static_cast<std::size_t>(nodes.at(std::min(x, nodes.width - 1), std::min(y, nodes.height - 1)));
        patch.points.set(i, nodes.values, patch.at[i]);
        if (x < nodes.width && y < nodes.height && nodes.values[6][patch.at[i]] > 0.0f) patch.active |= 1u << i;
    }
    // The first VPLs of the list are a stratified sample of the whole, their quarters again.
    const unsigned asked = std::min(screen.quality.node_vpls, static_cast<unsigned>(cast.vpls.size()));
    const std::size_t per_node = std::max(1u, asked / 4);
    result.vpls = std::span(cast.vpls).subspan(static_cast<std::size_t>(parity) * per_node, per_node);
    return result;
}

namespace {

constexpr float kUnknownVariance = 1e6f;  // of a share of nothing

// The variance of each point's blocked share as an estimate of what all VPLs would say, if what a VPL brings tells
// nothing of whether it is seen: at most a quarter over the effective number of VPLs asked (Kish 1965), (Σ w)² / Σ w².
// brings: of those VPLs, as terms() writes it; query: that asked them.
void share_variances(const std::vector<float>& brings, const VplQuery& query, float* out) {
    double squares[kLanes] = {};  // floats would not hold those of bright VPLs
    for (std::size_t v = 0; v < brings.size(); v += kLanes) {
        for (std::size_t i = 0; i < kLanes; ++i)
            squares[i] += static_cast<double>(brings[v + i]) * static_cast<double>(brings[v + i]);
    }
    for (int i = 0; i < trace::kPacket; ++i) {
        const auto all = static_cast<double>(query.open(i));
        out[i] = all > 0.0 ? static_cast<float>(0.25 * squares[i] / (all * all)) : kUnknownVariance;
    }
}

}  // namespace

Planes trace_occlusion(const ScreenGrid& screen, const LightView& light, Pool& pool) {
    const Grid& nodes = screen.nodes;
    const Quality& quality = screen.quality;
    const float near_per_depth = kWindowNear * screen.depth_per_point * static_cast<float>(quality.node_stride);
    Planes result(2, std::vector<float>(nodes.size() + kLanes, 0.0f));
    if (light.vpls.dark() || quality.node_vpls == 0) return result;  // nothing is blocked
    Planes raw(4, result[0]);
    std::fill(raw[3].begin(), raw[3].end(), kUnknownVariance);
    pool.run(asking_nodes(screen), [&](int job) {
        const auto [patch, vpls] = asking_nodes_at(screen, light.vpls, job);
        if (patch.active == 0) return;
        static thread_local std::vector<float> brings;
        brings.resize(vpls.size() * kLanes);
        VplQuery query(patch.points.off(light.geometry), patch.active);
        terms(query.points(), glm::vec3(light.position), vpls, quality.kappa, brings.data());
        for (std::size_t v = 0; v < vpls.size(); ++v) query.ask(light, vpls[v], &brings[v * kLanes]);
        float variances[kLanes];
        share_variances(brings, query, variances);
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((patch.active >> i & 1u) == 0) continue;
            raw[0][patch.at[i]] = query.open(i);
            raw[1][patch.at[i]] = query.blocked(i);
            raw[2][patch.at[i]] = 1.0f - query.seen(i);
            raw[3][patch.at[i]] = variances[i];
        }
    });
    for (std::vector<float>& plane : raw) nodes.extend(plane);
    // 2 × 2 nodes ask different VPLs: a tent over 3 × 3 holds each of the four sets equally where all are alike.
    const GridRows rows = nodes.rows();
    const auto first = static_cast<std::size_t>(nodes.at(0, 0));
    const NodeShares in{&raw[0][first], &raw[1][first], &raw[2][first], &raw[3][first]};
    pool.run(nodes.height, [&](int y) {
        filter_nodes_row(rows, y, nodes.width, near_per_depth, in, &result[0][first], &result[1][first]);
    });
    for (std::vector<float>& plane : result) nodes.extend(plane);
    return result;
}

}  // namespace gonio::shade
