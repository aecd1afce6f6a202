#include "ies/solid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace gonio::ies {

namespace {

using Vector = std::array<double, 3>;

constexpr std::size_t kMaxRows = 721;  // a quarter degree; finer grids are sampled, so that the mesh stays bounded
constexpr std::size_t kMaxColumns = 1441;

// The grid lines with each gap divided into equal parts of at most max_step; evenly spaced where that is too many.
std::vector<double> refine(const std::vector<double>& lines, double max_step, std::size_t max_count) {
    std::vector<double> result;
    for (std::size_t i = 0; i + 1 < lines.size() && result.size() <= max_count; ++i) {
        const double gap = lines[i + 1] - lines[i];
        const auto parts = static_cast<std::size_t>(std::clamp(std::ceil(gap / max_step - 1e-9), 1.0, 1e6));
        for (std::size_t k = 0; k < parts && result.size() <= max_count; ++k) {
            result.push_back(lines[i] + gap * static_cast<double>(k) / static_cast<double>(parts));
        }
    }
    result.push_back(lines.back());
    if (result.size() <= max_count) return result;
    result.resize(max_count);
    for (std::size_t i = 0; i < max_count; ++i) {
        result[i] = std::lerp(lines.front(), lines.back(), static_cast<double>(i) / static_cast<double>(max_count - 1));
    }
    return result;
}

Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double length(const Vector& a) {
    return std::hypot(a[0], a[1], a[2]);
}

struct Builder {
    const PhotometricWeb& web;
    std::vector<Vector> points;
    std::vector<Vector> directions;
    std::vector<std::uint32_t> triangles;

    std::uint32_t add(double v, double h) {
        const Direction direction = direction_of(Goniometer::type_c, Angle::radians(v), Angle::radians(h));
        const double radius = intensity(web, direction).in(cd);
        directions.push_back(direction);
        points.push_back({direction[0] * radius, direction[1] * radius, direction[2] * radius});
        return static_cast<std::uint32_t>(points.size() - 1);
    }

    // The end of the solid at v: the pole itself, or the origin where the web stops short of the pole.
    std::uint32_t add_apex(double v) {
        const bool bottom = v < std::numbers::pi / 2;
        const std::uint32_t index = add(v, 0.0);
        directions[index] = {0.0, 0.0, bottom ? -1.0 : 1.0};
        if (std::sin(v) > 1e-9) points[index] = {0.0, 0.0, 0.0};
        return index;
    }

    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) { triangles.insert(triangles.end(), {a, b, c}); }
};

// Area-weighted mean of the adjoining triangles; the vertex's own direction where they have no area.
std::vector<Vector> vertex_normals(const Builder& mesh) {
    std::vector<Vector> normals(mesh.points.size(), Vector{});
    for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
        const Vector& a = mesh.points[mesh.triangles[t]];
        const Vector& b = mesh.points[mesh.triangles[t + 1]];
        const Vector& c = mesh.points[mesh.triangles[t + 2]];
        const Vector n = cross({b[0] - a[0], b[1] - a[1], b[2] - a[2]}, {c[0] - a[0], c[1] - a[1], c[2] - a[2]});
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t axis = 0; axis < 3; ++axis) normals[mesh.triangles[t + k]][axis] += n[axis];
        }
    }
    for (std::size_t i = 0; i < normals.size(); ++i) {
        const double norm = length(normals[i]);
        if (!(norm > 0.0)) normals[i] = mesh.directions[i];
        const double scale = 1.0 / length(normals[i]);
        for (double& component : normals[i]) component *= scale;
    }
    return normals;
}

}  // namespace

SolidMesh photometric_solid(const PhotometricWeb& web, Angle max_step) {
    if (!(peak_intensity(web) > 0.0 * cd)) return {};
    const double step = std::max(max_step.radians(), 1e-3);
    const bool type_c = web.goniometer == Goniometer::type_c;
    const std::vector<double> rows = refine(type_c ? web.v_rad : std::vector{0.0, kPi}, step, kMaxRows);
    std::vector<double> columns = refine(type_c ? web.h_rad : std::vector{0.0, 2.0 * kPi}, step, kMaxColumns);
    columns.pop_back();  // 2 pi is column 0 again

    Builder mesh{web, {}, {}, {}};
    const std::uint32_t first_apex = mesh.add_apex(rows.front());
    const std::uint32_t last_apex = mesh.add_apex(rows.back());
    std::vector<std::uint32_t> ring_begin;
    for (const double v : rows) {
        if (std::sin(v) <= 1e-9) continue;
        ring_begin.push_back(static_cast<std::uint32_t>(mesh.points.size()));
        for (const double h : columns) mesh.add(v, h);
    }
    const auto count = static_cast<std::uint32_t>(columns.size());
    for (std::uint32_t h = 0; h < count; ++h) {
        const std::uint32_t next = (h + 1) % count;
        if (ring_begin.empty()) break;
        mesh.triangle(first_apex, ring_begin.front() + next, ring_begin.front() + h);
        for (std::size_t r = 0; r + 1 < ring_begin.size(); ++r) {
            const std::uint32_t low = ring_begin[r];
            const std::uint32_t high = ring_begin[r + 1];
            mesh.triangle(low + h, low + next, high + h);
            mesh.triangle(low + next, high + next, high + h);
        }
        mesh.triangle(last_apex, ring_begin.back() + h, ring_begin.back() + next);
    }

    SolidMesh result;
    for (const Vector& p : mesh.points) {
        for (const double component : p) result.positions.push_back(static_cast<float>(component));
    }
    for (const Vector& n : vertex_normals(mesh)) {
        for (const double component : n) result.normals.push_back(static_cast<float>(component));
    }
    result.triangles = std::move(mesh.triangles);
    return result;
}

}  // namespace gonio::ies
