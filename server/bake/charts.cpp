#include "server/bake/charts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <numbers>
#include <tuple>
#include <unordered_map>

namespace gonio::bake {
namespace {

constexpr double kNoArea = 1e-18;       // m²
constexpr double kOverlap = 1e-4;       // of the smaller triangle's size: what neighbours' roundings may share
constexpr int kTriedTurns = 24;         // of a chart's frame, over a right angle
constexpr std::size_t kMostCells = 96;  // a side of the grid that overlaps are sought in

struct Triangle {
    std::array<glm::dvec3, 3> corner;
    std::array<int, 3> vertex;  // welded
    glm::dvec3 normal{0.0};     // unit; zero: no area
};

using Flat = std::array<glm::dvec2, 3>;

// Whether two triangles share more than roundings: no edge of either parts them (separating axes).
bool overlap(const Flat& a, const Flat& b) {
    const auto size = [](const Flat& t) {
        return std::min({glm::length(t[1] - t[0]), glm::length(t[2] - t[1]), glm::length(t[0] - t[2])});
    };
    const double slack = kOverlap * std::min(size(a), size(b));
    const auto parts = [&](const Flat& t, const Flat& other) {
        const double turn = cross(t[1] - t[0], t[2] - t[0]) < 0.0 ? -1.0 : 1.0;
        for (int k = 0; k < 3; ++k) {
            const glm::dvec2 edge = t[(k + 1) % 3] - t[k];
            const double length = std::max(glm::length(edge), 1e-300);
            double deepest = -1e300;
            for (const glm::dvec2& p : other) deepest = std::max(deepest, turn * cross(edge, p - t[k]) / length);
            if (deepest <= slack) return true;
        }
        return false;
    };
    return !parts(a, b) && !parts(b, a);
}

// Sides over each other are taken out. Result: those; the others stay in order.
std::vector<int> take_out_overlapping(std::vector<int>& members, const std::vector<Flat>& flat) {
    glm::dvec2 low(1e300), high(-1e300);
    for (const int i : members) {
        for (const glm::dvec2& p : flat[static_cast<std::size_t>(i)]) low = glm::min(low, p), high = glm::max(high, p);
    }
    const auto side = static_cast<int>(std::clamp<std::size_t>(
        static_cast<std::size_t>(std::sqrt(static_cast<double>(members.size()))), 1, kMostCells));
    const glm::dvec2 per = static_cast<double>(side) / glm::max(high - low, glm::dvec2(1e-300));
    std::vector<std::vector<int>> cells(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    std::vector<int> kept, out;
    for (const int i : members) {
        const Flat& t = flat[static_cast<std::size_t>(i)];
        const glm::dvec2 from = (glm::min(glm::min(t[0], t[1]), t[2]) - low) * per,
                         to = (glm::max(glm::max(t[0], t[1]), t[2]) - low) * per;
        const auto cell = [&](double at) { return std::clamp(static_cast<int>(at), 0, side - 1); };
        bool free = true;
        const auto each_cell = [&](auto&& job) {
            for (int y = cell(from.y); y <= cell(to.y) && free; ++y)
                for (int x = cell(from.x); x <= cell(to.x) && free; ++x)
                    job(cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) +
                              static_cast<std::size_t>(x)]);
        };
        each_cell([&](const std::vector<int>& there) {
            for (const int other : there) free = free && !overlap(t, flat[static_cast<std::size_t>(other)]);
        });
        (free ? kept : out).push_back(i);
        if (free) each_cell([&](std::vector<int>& there) { there.push_back(i); });
    }
    members = std::move(kept);
    return out;
}

// The frame whose rectangle around the points is the smallest.
void frame(Chart& chart, const glm::dvec3& normal, const std::vector<glm::dvec3>& points) {
    const glm::dvec3 helper = std::abs(normal.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
    const glm::dvec3 x = glm::normalize(glm::cross(helper, normal)), y = glm::cross(normal, x);
    const glm::dvec3 first = points.front();
    std::vector<glm::dvec2> flat;
    for (const glm::dvec3& p : points) flat.emplace_back(glm::dot(p - first, x), glm::dot(p - first, y));
    // Turns along edges first: a rectangle has its own frame.
    std::vector<double> turns;
    for (std::size_t i = 0; i + 1 < flat.size() && i < 64; ++i) {
        const glm::dvec2 edge = flat[i + 1] - flat[i];
        if (glm::length(edge) > 0.0) turns.push_back(std::atan2(edge.y, edge.x));
    }
    for (int i = 0; i < kTriedTurns; ++i) turns.push_back(0.5 * std::numbers::pi * i / kTriedTurns);
    double best = 1e300;
    for (const double turn : turns) {
        const glm::dvec2 a(std::cos(turn), std::sin(turn)), b(-a.y, a.x);
        glm::dvec2 low(1e300), high(-1e300);
        for (const glm::dvec2& p : flat) {
            const glm::dvec2 q(glm::dot(p, a), glm::dot(p, b));
            low = glm::min(low, q), high = glm::max(high, q);
        }
        const glm::dvec2 size = high - low;
        // Equal but for roundings: the first one stays, so that the layout does not hang on them.
        if (size.x * size.y >= best * (1.0 - 1e-9)) continue;
        best = size.x * size.y;
        chart.across = a.x * x + a.y * y;
        chart.up = b.x * x + b.y * y;
        chart.origin = first + low.x * chart.across + low.y * chart.up;
        chart.size_m = size;
    }
}

struct InstanceSides {
    const trace::Geometry& geometry;
    int instance;
    std::vector<Triangle> triangles;
    std::vector<std::array<int, 3>> neighbour;  // over edge k, from corner k to the next; -1: none, or more than one

    InstanceSides(const trace::Geometry& of, int number) : geometry(of), instance(number) {
        const Instance& placed = of.asset().instances[static_cast<std::size_t>(number)];
        const Mesh& mesh = of.asset().meshes[static_cast<std::size_t>(placed.mesh)];
        const std::vector<int> weld = welded(of, number);
        triangles.resize(mesh.indices.size() / 3);
        neighbour.assign(triangles.size(), {-1, -1, -1});
        std::unordered_map<std::uint64_t, std::pair<int, int>> open;  // an edge as it runs -> triangle, corner
        for (std::size_t t = 0; t < triangles.size(); ++t) {
            Triangle& triangle = triangles[t];
            triangle.corner = corners_of(of, {number, static_cast<int>(t), false});
            for (std::size_t k = 0; k < 3; ++k) triangle.vertex[k] = weld[mesh.indices[3 * t + k]];
            const glm::dvec3 area =
                glm::cross(triangle.corner[1] - triangle.corner[0], triangle.corner[2] - triangle.corner[0]);
            const double twice = glm::length(area);
            if (twice > 2.0 * kNoArea) triangle.normal = area / twice;
        }
        const auto key = [](int a, int b) {
            return static_cast<std::uint64_t>(static_cast<std::uint32_t>(a)) << 32 | static_cast<std::uint32_t>(b);
        };
        for (std::size_t t = 0; t < triangles.size(); ++t) {
            if (triangles[t].normal == glm::dvec3(0.0)) continue;
            for (std::size_t k = 0; k < 3; ++k) {
                const auto [at, fresh] = open.try_emplace(key(triangles[t].vertex[k], triangles[t].vertex[(k + 1) % 3]),
                                                          static_cast<int>(t), static_cast<int>(k));
                if (!fresh) at->second.first = -1;  // two triangles run along it the same way: no surface
            }
        }
        for (std::size_t t = 0; t < triangles.size(); ++t) {
            if (triangles[t].normal == glm::dvec3(0.0)) continue;
            for (std::size_t k = 0; k < 3; ++k) {
                const int a = triangles[t].vertex[k], b = triangles[t].vertex[(k + 1) % 3];
                const auto own = open.find(key(a, b)), other = open.find(key(b, a));
                if (own == open.end() || own->second.first < 0 || other == open.end()) continue;
                neighbour[t][k] = other->second.first;
            }
        }
    }

    // Adds the charts of the triangles that wait; those that would lie over others of their chart wait again.
    void grow(double least_cosine, bool back, std::vector<char> waits, std::vector<Chart>& charts) const {
        std::vector<Flat> flat(triangles.size());
        for (std::size_t seed = 0; seed < triangles.size(); ++seed) {
            while (waits[seed] != 0 && triangles[seed].normal != glm::dvec3(0.0)) {
                std::vector<int> members{static_cast<int>(seed)};
                waits[seed] = 0;
                const glm::dvec3 normal = triangles[seed].normal;
                for (std::size_t i = 0; i < members.size(); ++i) {
                    for (const int next : neighbour[static_cast<std::size_t>(members[i])]) {
                        if (next < 0 || waits[static_cast<std::size_t>(next)] == 0) continue;
                        if (glm::dot(triangles[static_cast<std::size_t>(next)].normal, normal) < least_cosine) continue;
                        waits[static_cast<std::size_t>(next)] = 0;
                        members.push_back(next);
                    }
                }
                Chart chart;
                std::vector<glm::dvec3> points;
                const auto settle = [&] {
                    points.clear();
                    for (const int i : members) {
                        for (const glm::dvec3& p : triangles[static_cast<std::size_t>(i)].corner) points.push_back(p);
                    }
                    frame(chart, back ? -normal : normal, points);
                };
                settle();
                if (members.size() > 1) {
                    for (const int i : members) {
                        for (std::size_t k = 0; k < 3; ++k)
                            flat[static_cast<std::size_t>(i)][k] =
                                chart.flat(triangles[static_cast<std::size_t>(i)].corner[k]);
                    }
                    const std::vector<int> out = take_out_overlapping(members, flat);
                    for (const int i : out) waits[static_cast<std::size_t>(i)] = 1;
                    if (!out.empty()) settle();
                }
                for (const int i : members) chart.sides.push_back({instance, i, back});
                charts.push_back(std::move(chart));
            }
        }
    }
};

}  // namespace

std::vector<int> welded(const trace::Geometry& geometry, int instance) {
    const auto positions = geometry.positions(instance);
    // Roundings of a transform: a millionth of the scene.
    const double cell = std::max(1e-9, 2e-6 * static_cast<double>(geometry.extent()));
    std::map<std::tuple<std::int64_t, std::int64_t, std::int64_t>, int> numbers;
    std::vector<int> result;
    result.reserve(positions.size());
    for (const glm::vec3& p : positions) {
        const auto snap = [&](float x) {
            return static_cast<std::int64_t>(std::llround(static_cast<double>(x) / cell));
        };
        const auto at = numbers.try_emplace({snap(p.x), snap(p.y), snap(p.z)}, static_cast<int>(numbers.size())).first;
        result.push_back(at->second);
    }
    return result;
}

std::array<glm::dvec3, 3> corners_of(const trace::Geometry& geometry, const Side& side) {
    const auto c = geometry.corners(side.instance, side.triangle);
    if (side.back) return {glm::dvec3(c[0]), glm::dvec3(c[2]), glm::dvec3(c[1])};
    return {glm::dvec3(c[0]), glm::dvec3(c[1]), glm::dvec3(c[2])};
}

std::vector<Chart> grow_charts(const trace::Geometry& geometry, double angle_rad, double small_m2) {
    std::vector<Chart> charts;
    const SceneAsset& asset = geometry.asset();
    for (std::size_t i = 0; i < asset.instances.size(); ++i) {
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(asset.instances[i].mesh)];
        const InstanceSides sides(geometry, static_cast<int>(i));
        for (const bool back : {false, true}) {
            if (back && !asset.materials[static_cast<std::size_t>(mesh.material)].double_sided) continue;
            std::vector<Chart> grown;
            sides.grow(std::cos(angle_rad), back, std::vector<char>(sides.triangles.size(), 1), grown);
            std::vector<char> small(sides.triangles.size(), 0);
            std::erase_if(grown, [&](const Chart& chart) {
                if (chart.size_m.x * chart.size_m.y >= small_m2) return false;
                for (const Side& side : chart.sides) small[static_cast<std::size_t>(side.triangle)] = 1;
                return true;
            });
            sides.grow(std::cos(kSmallChartAngle_rad), back, std::move(small), grown);
            std::move(grown.begin(), grown.end(), std::back_inserter(charts));
        }
    }
    return charts;
}

}  // namespace gonio::bake
