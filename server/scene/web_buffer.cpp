#include "server/scene/web_buffer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "shaders/shared/layouts.h"

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

std::vector<std::uint32_t> pack_web(const ies::PhotometricWeb& web, double peak_cd) {
    const std::size_t table = table_size(web);
    const layouts::WebHeader header = {static_cast<std::uint32_t>(web.goniometer),
                                       static_cast<std::uint32_t>(web.v_rad.size()),
                                       static_cast<std::uint32_t>(web.h_rad.size()), static_cast<std::uint32_t>(table)};
    std::vector<std::uint32_t> words = {header.goniometer, header.n_v, header.n_h, header.table};
    words.reserve(words.size() + layouts::web_ratios(header) + web.candela.size());
    for (double v : web.v_rad) words.push_back(bits(v));
    for (double h : web.h_rad) words.push_back(bits(h));
    append_first_cells(web.v_rad, table, words);
    append_first_cells(web.h_rad, table, words);
    for (float candela : web.candela)
        words.push_back(bits(peak_cd > 0.0 ? static_cast<double>(candela) / peak_cd : 0.0));
    return words;
}

PackedWeb web_of(const std::uint32_t* words) {
    const layouts::WebHeader& header = layouts::web_header(words);
    const std::size_t n_v = header.n_v, n_h = header.n_h;
    const float *values = layouts::web_values(words), *column = values + layouts::web_ratios(header);
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
            even(values + layouts::web_h(header), n_h)};
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

int mask_face_size(const ies::PhotometricWeb& web) {
    double step = finest_step(web.v_rad);
    if (web.h_rad.size() > 2) step = std::min(step, finest_step(web.h_rad));
    const double texels = 2.0 * (std::numbers::pi / 2) / step;
    return static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::clamp(texels, 64.0, 1024.0))));
}

}  // namespace gonio
