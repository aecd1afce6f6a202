// Pictures that the built-in scenes paint on their surfaces: the same bytes every time.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "ies/core/srgb.h"
#include "server/assets/mesh_builder.h"

namespace gonio {
namespace {

// A number in 0..1 for a lattice point (an integer hash by multiplication and shifts).
double lattice(int x, int y, std::uint32_t seed) {
    std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^ static_cast<std::uint32_t>(y) * 0xd8163841u ^ seed;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return static_cast<double>((h ^ h >> 15) >> 8) / 16777216.0;
}

// Smooth noise in 0..1 with `cells` lattice cells along the unit square, periodic.
double noise(double u, double v, int cells, std::uint32_t seed) {
    const double x = u * cells, y = v * cells;
    const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
    const auto smooth = [](double t) { return t * t * (3.0 - 2.0 * t); };
    const double fx = smooth(x - ix), fy = smooth(y - iy);
    const auto at = [&](int dx, int dy) {
        return lattice(((ix + dx) % cells + cells) % cells, ((iy + dy) % cells + cells) % cells, seed);
    };
    return (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy) + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy;
}

// Noise of `octaves` halving scales, in 0..1.
double cloud(double u, double v, int cells, int octaves, std::uint32_t seed) {
    double sum = 0.0, weight = 0.5, total = 0.0;
    for (int i = 0; i < octaves; ++i, cells *= 2, weight *= 0.5) {
        sum += weight * noise(u, v, cells, seed + static_cast<std::uint32_t>(i) * 77u);
        total += weight;
    }
    return sum / total;
}

// albedo(u, v): linear reflectance at a pixel's centre, v downwards.
template <typename Albedo>
Image paint(int size_px, Albedo albedo) {
    Image image;
    image.width_px = image.height_px = size_px;
    image.rgba.reserve(std::size_t{4} * size_px * size_px);
    for (int y = 0; y < size_px; ++y) {
        for (int x = 0; x < size_px; ++x) {
            const glm::dvec3 c = albedo((x + 0.5) / size_px, (y + 0.5) / size_px);
            image.rgba.insert(image.rgba.end(), {srgb_byte(c.r), srgb_byte(c.g), srgb_byte(c.b), 255});
        }
    }
    return image;
}

}  // namespace

Image brick_texture(int size_px) {
    return paint(size_px, [](double u, double v) {
        constexpr int courses = 4, bricks = 2;
        constexpr double joint = 0.035;  // of a course's height
        const double row = v * courses;
        const int course = static_cast<int>(row);
        const double along = u * bricks + (course % 2) * 0.5;
        const int brick = static_cast<int>(std::floor(along)) % bricks;
        const double fy = row - course, fx = along - std::floor(along);
        const double edge = std::min({fy, 1.0 - fy, fx * 2.0, (1.0 - fx) * 2.0});
        const double grain = cloud(u, v, 16, 4, 11);
        if (edge < joint * (0.8 + 0.6 * grain)) return glm::dvec3(0.42, 0.39, 0.35) * (0.85 + 0.3 * grain);
        const double tone = 0.75 + 0.45 * lattice(brick, course, 5) + 0.35 * (grain - 0.5);
        return glm::dvec3(0.46, 0.22, 0.14) * tone;
    });
}

Image marble_texture(int size_px) {
    return paint(size_px, [](double u, double v) {
        const int column = u < 0.5 ? 0 : 1, row = v < 0.5 ? 0 : 1;
        const double fx = u * 2.0 - column, fy = v * 2.0 - row;
        const double edge = std::min({fx, 1.0 - fx, fy, 1.0 - fy});
        if (edge < 0.012) return glm::dvec3(0.22, 0.20, 0.18);
        const auto seed = static_cast<std::uint32_t>(31 + 2 * row + column);
        const double wave = std::sin(kTau * (fx + fy * 0.6 + 1.6 * cloud(u, v, 4, 5, seed)) * 1.5);
        const double vein = std::pow(1.0 - std::abs(wave), 6.0);
        const bool light = (row + column) % 2 == 0;
        const glm::dvec3 ground = light ? glm::dvec3(0.68, 0.64, 0.57) : glm::dvec3(0.30, 0.16, 0.12);
        const glm::dvec3 line = light ? glm::dvec3(0.40, 0.36, 0.33) : glm::dvec3(0.55, 0.42, 0.36);
        return ground * (0.92 + 0.16 * cloud(u, v, 8, 3, seed + 9)) * (1.0 - vein) + line * vein;
    });
}

Image plaster_texture(int size_px) {
    return paint(size_px, [](double u, double v) {
        return glm::dvec3(0.70, 0.65, 0.56) * (0.86 + 0.28 * cloud(u, v, 6, 5, 3));
    });
}

Image cloth_texture(int size_px) {
    return paint(size_px, [](double u, double v) {
        const double weave = 0.9 + 0.1 * std::sin(kTau * 48.0 * u) * std::sin(kTau * 48.0 * v);
        const double stripe = std::abs(std::fmod(u * 4.0, 1.0) - 0.5) < 0.06 ? 0.55 : 1.0;
        return glm::dvec3(weave * stripe);
    });
}

}  // namespace gonio
