#include "server/render/web_buffer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace gonio {
namespace {

std::uint32_t bits(double value) {
    return std::bit_cast<std::uint32_t>(static_cast<float>(value));
}

double finest_step(const std::vector<double>& angles) {
    double step = 1e9;
    for (std::size_t i = 1; i < angles.size(); ++i) step = std::min(step, angles[i] - angles[i - 1]);
    return step;
}

// For equal buckets of the range, the cell that holds the bucket's start.
void append_first_cells(const std::vector<double>& angles, std::size_t table, std::vector<std::uint32_t>& out) {
    const double low = angles.front(), range = angles.back() - angles.front();
    std::size_t cell = 0;
    for (std::size_t b = 0; b < table; ++b) {
        const double start = low + range * static_cast<double>(b) / static_cast<double>(table);
        while (cell + 2 < angles.size() && angles[cell + 1] <= start) ++cell;
        out.push_back(bits(static_cast<double>(cell)));
    }
}

std::size_t table_size(const ies::PhotometricWeb& web) {
    const auto buckets = [](const std::vector<double>& angles) {
        return (angles.back() - angles.front()) / finest_step(angles);
    };
    // A quarter of the finest step per bucket: the shader's eight steps always reach the cell, except for steps below
    // 1/16384 of the range, which the cap leaves out.
    const double wanted = std::max(buckets(web.v_rad), buckets(web.h_rad));
    return std::bit_ceil(static_cast<std::size_t>(std::clamp(wanted, 16.0, 16384.0)));
}

}  // namespace

std::vector<std::uint32_t> pack_web(const ies::PhotometricWeb& web) {
    const std::size_t table = table_size(web);
    std::vector<std::uint32_t> words = {
        static_cast<std::uint32_t>(web.goniometer), static_cast<std::uint32_t>(web.v_rad.size()),
        static_cast<std::uint32_t>(web.h_rad.size()), static_cast<std::uint32_t>(table)};
    words.reserve(4 + web.v_rad.size() + web.h_rad.size() + 2 * table + web.candela.size());
    for (double v : web.v_rad) words.push_back(bits(v));
    for (double h : web.h_rad) words.push_back(bits(h));
    append_first_cells(web.v_rad, table, words);
    append_first_cells(web.h_rad, table, words);
    const double peak = ies::peak_intensity(web).in(cd);
    for (float candela : web.candela) words.push_back(bits(peak > 0.0 ? static_cast<double>(candela) / peak : 0.0));
    return words;
}

shade::Web web_of(const std::uint32_t* words) {
    const std::size_t n_v = words[1], n_h = words[2];
    const auto* values = reinterpret_cast<const float*>(words + 4);
    const float* column = values + n_v + n_h + std::size_t{2} * words[3];
    const auto even = [](const float* axis, std::size_t n) {
        const double step =
            (static_cast<double>(axis[n - 1]) - static_cast<double>(axis[0])) / static_cast<double>(n - 1);
        for (std::size_t i = 0; i < n; ++i) {
            const double off =
                static_cast<double>(axis[i]) - static_cast<double>(axis[0]) - step * static_cast<double>(i);
            if (std::abs(off) > 1e-6) return false;
        }
        return true;
    };
    return {words, n_h == 2 && std::equal(column, column + n_v, column + n_v), even(values, n_v),
            even(values + n_v, n_h)};
}
bool uniform_grid(const ies::PhotometricWeb& web) {
    const auto uniform = [](const std::vector<double>& angles) {
        const double step = (angles.back() - angles.front()) / static_cast<double>(angles.size() - 1);
        for (std::size_t i = 0; i < angles.size(); ++i) {
            if (std::abs(angles[i] - angles.front() - step * static_cast<double>(i)) > 1e-6 * step) return false;
        }
        return true;
    };
    return uniform(web.v_rad) && uniform(web.h_rad);
}

namespace {

constexpr double kStep_rad = 2.5 * std::numbers::pi / 180.0;

// visit(direction, half_v, half_h) at the corners of steps of at most kStep_rad in every cell of the web that holds
// light; half_v, half_h: half a step, rad. Ends early where visit returns false.
template <typename Visit>
void visit_lit_directions(const ies::PhotometricWeb& web, const Visit& visit) {
    for (std::size_t h = 0; h + 1 < web.h_rad.size(); ++h) {
        for (std::size_t v = 0; v + 1 < web.v_rad.size(); ++v) {
            if (std::max({web.at(h, v), web.at(h, v + 1), web.at(h + 1, v), web.at(h + 1, v + 1)}) <= 0.0f) continue;
            const double dv = web.v_rad[v + 1] - web.v_rad[v], dh = web.h_rad[h + 1] - web.h_rad[h];
            const int nv = std::max(1, static_cast<int>(std::ceil(dv / kStep_rad))),
                      nh = std::max(1, static_cast<int>(std::ceil(dh / kStep_rad)));
            for (int i = 0; i <= nv; ++i) {
                for (int j = 0; j <= nh; ++j) {
                    const ies::Direction d =
                        ies::direction_of(web.goniometer, Angle::radians(web.v_rad[v] + dv * i / nv),
                                          Angle::radians(web.h_rad[h] + dh * j / nh));
                    if (!visit(d, 0.5 * (dv / nv), 0.5 * (dh / nh))) return;
                }
            }
        }
    }
}

}  // namespace

std::vector<glm::vec3> lit_directions(const ies::PhotometricWeb& web) {
    // Rounded to sixteenths, off by half their diagonal; steps of visit_lit_directions are off by half of two.
    constexpr int kPer = 16, kSide = 2 * kPer + 1;
    static_assert(0.87 / kPer + kStep_rad < double{kLitDirectionsOff});
    std::vector<bool> lit(std::size_t{kSide} * kSide * kSide);
    visit_lit_directions(web, [&](const ies::Direction& d, double, double) {
        const auto cell = [&](int k) { return static_cast<std::size_t>(std::lround(kPer * d[k]) + kPer); };
        lit[(cell(2) * kSide + cell(1)) * kSide + cell(0)] = true;
        return true;
    });
    std::vector<glm::vec3> directions;
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
        if (lit[static_cast<std::size_t>(i)])
            directions.push_back(glm::vec3(i % kSide - kPer, i / kSide % kSide - kPer, i / (kSide * kSide) - kPer) /
                                 static_cast<float>(kPer));
    }
    return directions;
}

unsigned reached_faces(std::span<const glm::vec3> lit_directions, const glm::mat3& world_from_light) {
    unsigned faces = 0;
    for (const glm::vec3& direction : lit_directions) {
        const glm::vec3 w = world_from_light * direction, size = glm::abs(w);
        const float largest = std::max({size.x, size.y, size.z});
        for (int k = 0; k < 3; ++k) {
            if (size[k] >= largest - 1.5f * kLitDirectionsOff) faces |= 1u << (2 * k + (w[k] >= 0.0f ? 0 : 1));
        }
        if (faces == 63u) break;
    }
    return faces;
}

float beam_cosine(const ies::PhotometricWeb& web) {
    double least = 1.0;
    visit_lit_directions(web, [&](const ies::Direction& d, double half_v, double half_h) {
        // Within half a step of a sample the cosine changes by no more than that angle.
        const double margin = half_v + (web.goniometer == ies::Goniometer::type_c ? 0.0 : half_h);
        least = std::min(least, -d[2] - margin);
        return true;
    });
    return static_cast<float>(std::max(least, -1.0));
}

int mask_face_size(const ies::PhotometricWeb& web) {
    double step = finest_step(web.v_rad);
    if (web.h_rad.size() > 2) step = std::min(step, finest_step(web.h_rad));
    const double texels = 2.0 * (std::numbers::pi / 2) / step;
    return static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::clamp(texels, 64.0, 1024.0))));
}

}  // namespace gonio
