#include "server/bake/seams.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

namespace gonio::bake {
namespace {

constexpr double kPerTexel = 2.0;  // reads compared along a seam
constexpr int kMostReads = 1 << 15;
constexpr int kRounds = 60;  // of conjugate gradients at most
constexpr double kEnough = 1e-10;

// Four texels and their weights.
struct Read {
    std::array<std::int32_t, 4> pixel;
    std::array<float, 4> weight;
};

Read read_at(const Atlas& atlas, const glm::dvec2& at) {
    const glm::dvec2 p = at - 0.5, low = glm::floor(p), part = p - low;
    Read read;
    for (std::size_t k = 0; k < 4; ++k) {
        const int dx = static_cast<int>(k % 2), dy = static_cast<int>(k / 2);
        const int x = std::clamp(static_cast<int>(low.x) + dx, 0, atlas.width - 1),
                  y = std::clamp(static_cast<int>(low.y) + dy, 0, atlas.height - 1);
        read.pixel[k] = y * atlas.width + x;
        read.weight[k] = static_cast<float>((dx != 0 ? part.x : 1.0 - part.x) * (dy != 0 ? part.y : 1.0 - part.y));
    }
    return read;
}

// Calls job(read on one side, read on the other) along all seams.
template <typename Job>
void each_pair(const Atlas& atlas, Job job) {
    for (const Seam& seam : atlas.seams) {
        const double length = std::max(glm::length(seam.to[0] - seam.from[0]), glm::length(seam.to[1] - seam.from[1]));
        const int reads = std::clamp(static_cast<int>(std::ceil(length * kPerTexel)), 1, kMostReads);
        for (int i = 0; i < reads; ++i) {
            const double t = (i + 0.5) / reads;
            job(read_at(atlas, glm::mix(seam.from[0], seam.to[0], t)),
                read_at(atlas, glm::mix(seam.from[1], seam.to[1], t)));
        }
    }
}

// One difference of two reads: unknowns and weights.
struct Row {
    std::array<std::int32_t, 8> unknown;
    std::array<float, 8> weight;
};

double dot(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
}

// out = (JᵀJ + k² 1) in
void multiply(const std::vector<Row>& rows, const std::vector<double>& in, std::vector<double>& out) {
    for (std::size_t i = 0; i < in.size(); ++i) out[i] = kKeep * kKeep * in[i];
    for (const Row& row : rows) {
        double difference = 0.0;
        for (std::size_t k = 0; k < 8; ++k)
            difference += static_cast<double>(row.weight[k]) * in[static_cast<std::size_t>(row.unknown[k])];
        for (std::size_t k = 0; k < 8; ++k)
            out[static_cast<std::size_t>(row.unknown[k])] += static_cast<double>(row.weight[k]) * difference;
    }
}

}  // namespace

void level_seams(const Atlas& atlas, const FillPlan& plan, std::vector<float>& picture, int channels) {
    std::unordered_map<std::int32_t, std::int32_t> number;
    std::vector<std::int32_t> pixels;
    std::vector<Row> rows;
    each_pair(atlas, [&](const Read& a, const Read& b) {
        Row row;
        for (std::size_t k = 0; k < 8; ++k) {
            const Read& read = k < 4 ? a : b;
            const std::int32_t pixel = read.pixel[k % 4];
            if (plan.sheet_at[static_cast<std::size_t>(pixel)] < 0) return;
            const auto [at, fresh] = number.try_emplace(pixel, static_cast<std::int32_t>(pixels.size()));
            if (fresh) pixels.push_back(pixel);
            row.unknown[k] = at->second;
            row.weight[k] = k < 4 ? read.weight[k] : -read.weight[k % 4];
        }
        rows.push_back(row);
    });
    if (rows.empty()) return;
    const std::size_t n = pixels.size();
    std::vector<double> start(n), change(n), residual(n), direction(n), product(n), least(n), most(n);
    for (int channel = 0; channel < channels; ++channel) {
        const auto value = [&](std::size_t i) -> float& {
            return picture[static_cast<std::size_t>(pixels[i]) * static_cast<std::size_t>(channels) +
                           static_cast<std::size_t>(channel)];
        };
        for (std::size_t i = 0; i < n; ++i) start[i] = static_cast<double>(value(i));
        // What a seam has nowhere it brings to no texel: light does not creep along it into the dark.
        std::fill(least.begin(), least.end(), 1e300);
        std::fill(most.begin(), most.end(), 0.0);
        for (const Row& row : rows) {
            double low = 1e300, high = 0.0;
            for (const std::int32_t i : row.unknown) {
                low = std::min(low, start[static_cast<std::size_t>(i)]);
                high = std::max(high, start[static_cast<std::size_t>(i)]);
            }
            for (const std::int32_t i : row.unknown) {
                least[static_cast<std::size_t>(i)] = std::min(least[static_cast<std::size_t>(i)], low);
                most[static_cast<std::size_t>(i)] = std::max(most[static_cast<std::size_t>(i)], high);
            }
        }
        // (JᵀJ + k²) change = −JᵀJ start
        std::fill(change.begin(), change.end(), 0.0);
        std::fill(residual.begin(), residual.end(), 0.0);
        for (const Row& row : rows) {
            double difference = 0.0;
            for (std::size_t k = 0; k < 8; ++k)
                difference += static_cast<double>(row.weight[k]) * start[static_cast<std::size_t>(row.unknown[k])];
            for (std::size_t k = 0; k < 8; ++k)
                residual[static_cast<std::size_t>(row.unknown[k])] -= static_cast<double>(row.weight[k]) * difference;
        }
        direction = residual;
        double size = dot(residual, residual);
        const double enough = kEnough * size;
        for (int round = 0; round < kRounds && size > enough; ++round) {
            multiply(rows, direction, product);
            const double step = size / dot(direction, product);
            for (std::size_t i = 0; i < n; ++i) change[i] += step * direction[i], residual[i] -= step * product[i];
            const double next = dot(residual, residual);
            for (std::size_t i = 0; i < n; ++i) direction[i] = residual[i] + next / size * direction[i];
            size = next;
        }
        for (std::size_t i = 0; i < n; ++i)
            value(i) = static_cast<float>(std::clamp(start[i] + change[i], least[i], most[i]));
    }
}

double seam_difference(const Atlas& atlas, const std::vector<float>& picture, int channels) {
    double sum = 0.0;
    std::size_t count = 0;
    const auto n = static_cast<std::size_t>(channels);
    each_pair(atlas, [&](const Read& a, const Read& b) {
        for (std::size_t c = 0; c < n; ++c) {
            double difference = 0.0;
            for (std::size_t k = 0; k < 4; ++k)
                difference += static_cast<double>(a.weight[k] * picture[static_cast<std::size_t>(a.pixel[k]) * n + c] -
                                                  b.weight[k] * picture[static_cast<std::size_t>(b.pixel[k]) * n + c]);
            sum += difference * difference;
            ++count;
        }
    });
    return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
}

void find_seams(Atlas& atlas, const trace::Geometry& geometry) {
    struct Use {
        int side, corner;  // index into Atlas::sides; the edge runs from this corner to the next
    };
    const SceneAsset& asset = geometry.asset();
    const auto texel_near = [&](const PlacedSide& placed, const glm::dvec2& at) {
        const glm::dvec2 middle = (placed.corner[0] + placed.corner[1] + placed.corner[2]) / 3.0;
        const double away = std::max(glm::length(middle - at), 1e-9);
        const glm::ivec2 p(glm::floor(at + (middle - at) * std::min(0.5, 0.02 / away)));
        if (p.x < 0 || p.y < 0 || p.x >= atlas.width || p.y >= atlas.height) return -1;
        const std::int32_t texel =
            atlas.texel_at[static_cast<std::size_t>(p.y) * static_cast<std::size_t>(atlas.width) +
                           static_cast<std::size_t>(p.x)];
        return texel >= 0 && atlas.texels[static_cast<std::size_t>(texel)].sheet == placed.sheet ? texel : -1;
    };
    for (std::size_t begin = 0; begin < atlas.sides.size();) {
        const int instance = atlas.sides[begin].side.instance;
        std::size_t end = begin;
        while (end < atlas.sides.size() && atlas.sides[end].side.instance == instance) ++end;
        const Mesh& mesh =
            asset.meshes[static_cast<std::size_t>(asset.instances[static_cast<std::size_t>(instance)].mesh)];
        const std::vector<int> weld = welded(geometry, instance);
        std::unordered_map<std::uint64_t, std::vector<Use>> edges;
        for (std::size_t i = begin; i < end; ++i) {
            for (int k = 0; k < 3; ++k) {
                const auto base = static_cast<std::size_t>(atlas.sides[i].side.triangle) * 3;
                const auto a = static_cast<std::uint32_t>(weld[mesh.indices[base + static_cast<std::size_t>(k)]]),
                           b = static_cast<std::uint32_t>(
                               weld[mesh.indices[base + static_cast<std::size_t>((k + 1) % 3)]]);
                edges[static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b)].push_back(
                    {static_cast<int>(i), k});
            }
        }
        for (std::size_t i = begin; i < end; ++i) {  // in the order of sides: the same every time
            for (int k = 0; k < 3; ++k) {
                const PlacedSide& one = atlas.sides[i];
                const auto base = static_cast<std::size_t>(one.side.triangle) * 3;
                const std::uint32_t va = mesh.indices[base + static_cast<std::size_t>(k)],
                                    vb = mesh.indices[base + static_cast<std::size_t>((k + 1) % 3)];
                const auto a = static_cast<std::uint32_t>(weld[va]), b = static_cast<std::uint32_t>(weld[vb]);
                for (const Use& use : edges[static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b)]) {
                    const PlacedSide& other = atlas.sides[static_cast<std::size_t>(use.side)];
                    if (use.side <= static_cast<int>(i) || other.sheet == one.sheet || other.side.back != one.side.back)
                        continue;
                    const auto other_base = static_cast<std::size_t>(other.side.triangle) * 3;
                    int from = use.corner, to = (use.corner + 1) % 3;
                    if (static_cast<std::uint32_t>(weld[mesh.indices[other_base + static_cast<std::size_t>(from)]]) !=
                        a)
                        std::swap(from, to);
                    const auto normals_agree = [&](std::uint32_t mine, int theirs) {
                        const glm::vec3 n = mesh.vertices[mine].normal,
                                        m = mesh.vertices[mesh.indices[other_base + static_cast<std::size_t>(theirs)]]
                                                .normal;
                        return static_cast<double>(glm::dot(n, m)) > kSameNormal;
                    };
                    if (!normals_agree(va, from) || !normals_agree(vb, to)) continue;
                    const glm::dvec2 ends[2][2] = {{one.corner[k], one.corner[(k + 1) % 3]},
                                                   {other.corner[from], other.corner[to]}};
                    const int steps =
                        std::clamp(static_cast<int>(std::ceil(glm::length(ends[0][1] - ends[0][0]))), 1, kMostSide);
                    bool goes_on = false;
                    for (int s = 0; s < steps; ++s) {
                        const double t = (s + 0.5) / steps;
                        const int p = texel_near(one, glm::mix(ends[0][0], ends[0][1], t)),
                                  q = texel_near(other, glm::mix(ends[1][0], ends[1][1], t));
                        bool open = p >= 0 && q >= 0;
                        if (open) {
                            const Texel &tp = atlas.texels[static_cast<std::size_t>(p)],
                                        &tq = atlas.texels[static_cast<std::size_t>(q)];
                            const double texel_m =
                                atlas.texels_per_m > 0.0
                                    ? 1.0 / atlas.texels_per_m
                                    : std::sqrt(static_cast<double>(std::max(tp.area_m2, tq.area_m2)));
                            open = sees(geometry, tp, tq, static_cast<float>(0.1 * texel_m));
                        }
                        if (open) {
                            if (!goes_on) {
                                Seam& seam = atlas.seams.emplace_back();
                                seam.sheet[0] = one.sheet, seam.sheet[1] = other.sheet;
                                for (int e = 0; e < 2; ++e)
                                    seam.from[e] = glm::mix(ends[e][0], ends[e][1], static_cast<double>(s) / steps);
                            }
                            for (int e = 0; e < 2; ++e)
                                atlas.seams.back().to[e] =
                                    glm::mix(ends[e][0], ends[e][1], static_cast<double>(s + 1) / steps);
                        }
                        goes_on = open;
                    }
                }
            }
        }
        begin = end;
    }
}

}  // namespace gonio::bake
