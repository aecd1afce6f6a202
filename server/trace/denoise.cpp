#include "server/trace/denoise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "server/trace/parallel.h"
#include "server/trace/sources.h"

namespace gonio::trace {
namespace {

constexpr int kLevels = 4;                              // taps 1, 2, 4 and 8 pixels apart
constexpr float kKernel[3] = {0.375f, 0.25f, 0.0625f};  // B3 spline, by distance in taps
// Where a weight is 1/e:
constexpr float kNormal = 0.2f;        // difference of unit normals
constexpr float kDepth = 0.005f;       // depth from the pixel's plane, relative
constexpr float kNoise = 2.0f;         // difference of values, in its standard deviations
constexpr float kLeastAlbedo = 0.01f;  // below it a pixel says little of the irradiance

// What decides whether two pixels show the same surface.
struct Feature {
    glm::vec3 normal;
    float inverse_depth, step_x, step_y;                     // 1/m, and its change over a pixel on the pixel's plane
    float normal_variance, inverse_normal2, inverse_depth2;  // the latter: 1 over the squared tolerances
};

// Irradiance as numerator and denominator, of each half: pixels without albedo say nothing of it.
struct Cell {
    glm::vec3 light[2], share[2];
};

// What weights of values are made of: luminance of both halves' irradiance, and its variance.
struct Value {
    float half[2];
    float variance = 0.0f;
};

struct Grid {
    int width, height;
    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    }
};

// Result: the smaller of the differences to both neighbours: that on the pixel's own surface.
float own_step(float before, float here, float after) {
    const float a = here - before, b = after - here;
    return std::abs(a) < std::abs(b) ? a : b;
}

Feature feature_at(const DenoisePlanes& planes, const Grid& grid, int x, int y) {
    const auto& depth = planes.inverse_depth;
    const std::size_t at = grid.at(x, y);
    const auto step = [&](std::size_t before, std::size_t after) {
        if (before == at || after == at) return depth[after] - depth[before];
        return own_step(depth[before], depth[at], depth[after]);
    };
    Feature f;
    f.normal = planes.normal[at];
    f.inverse_depth = depth[at];
    f.step_x = step(grid.at(std::max(x - 1, 0), y), grid.at(std::min(x + 1, grid.width - 1), y));
    f.step_y = step(grid.at(x, std::max(y - 1, 0)), grid.at(x, std::min(y + 1, grid.height - 1)));
    f.normal_variance = std::max(0.0f, 1.0f - glm::dot(f.normal, f.normal));
    f.inverse_normal2 = 1.0f / std::max(kNormal * kNormal, f.normal_variance);
    const float tolerance = kDepth * f.inverse_depth;
    f.inverse_depth2 = 1.0f / std::max({tolerance * tolerance, planes.inverse_depth_variance[at], 1e-20f});
    return f;
}

// Result: squared distance of the features of q, (dx, dy) away, from those of p, in their tolerances.
float feature_distance(const Feature& p, const Feature& q, int dx, int dy) {
    const glm::vec3 turned = q.normal - p.normal;
    const float spread = p.normal_variance + std::min(p.normal_variance, q.normal_variance);
    const float off =
        q.inverse_depth - p.inverse_depth - p.step_x * static_cast<float>(dx) - p.step_y * static_cast<float>(dy);
    return std::max(0.0f, glm::dot(turned, turned) - spread) * p.inverse_normal2 + off * off * p.inverse_depth2;
}

float ratio(float light, float share) {
    return share > 0.0f ? light / share : 0.0f;
}

Value value_of(const Cell& cell) {
    return {{ratio(luminance(cell.light[0]), luminance(cell.share[0])),
             ratio(luminance(cell.light[1]), luminance(cell.share[1]))}};
}

// Calls tap(index, dx, dy, weight of the kernel) for the 25 taps around a pixel that lie in the picture.
template <typename Tap>
void each_tap(const Grid& grid, int x, int y, int step, const Tap& tap) {
    for (int j = -2; j <= 2; ++j) {
        const int v = y + j * step;
        if (v < 0 || v >= grid.height) continue;
        for (int i = -2; i <= 2; ++i) {
            const int u = x + i * step;
            if (u < 0 || u >= grid.width) continue;
            tap(grid.at(u, v), i * step, j * step, kKernel[std::abs(i)] * kKernel[std::abs(j)]);
        }
    }
}

// One level of the transform: `from` and `to` hold width · height cells.
class Level {
public:
    Level(const Grid& grid, const std::vector<Feature>& features, int step)
        : grid_(grid), features_(features), step_(step) {}

    // Result: variance of a half's irradiance about a pixel: of two independent values (a − b)²/2.
    float variance_at(const std::vector<Value>& values, int x, int y) const {
        const Feature& p = features_[grid_.at(x, y)];
        float sum = 0.0f, weights = 0.0f;
        each_tap(grid_, x, y, step_, [&](std::size_t q, int dx, int dy, float) {
            const float w = std::exp(-feature_distance(p, features_[q], dx, dy));
            const float difference = values[q].half[0] - values[q].half[1];
            sum += w * 0.5f * difference * difference;
            weights += w;
        });
        return sum / weights;
    }

    // Result: what a pixel's values are compared by: its neighbourhood's, by features alone. Otherwise a pixel that is
    // far off in both halves would keep to itself.
    Value guide_at(const std::vector<Cell>& from, int x, int y) const {
        const Feature& p = features_[grid_.at(x, y)];
        Cell sum{};
        each_tap(grid_, x, y, step_, [&](std::size_t q, int dx, int dy, float kernel) {
            const float w = kernel * std::exp(-feature_distance(p, features_[q], dx, dy));
            for (int h = 0; h < 2; ++h) sum.light[h] += w * from[q].light[h], sum.share[h] += w * from[q].share[h];
        });
        return value_of(sum);
    }

    // Each half is filtered with weights of the other: their noise is independent of the values they weigh.
    Cell filtered_at(const std::vector<Cell>& from, const std::vector<Value>& values, int x, int y) const {
        const std::size_t at = grid_.at(x, y);
        const Feature& p = features_[at];
        const Value& value = values[at];
        if (value.variance == 0.0f) return from[at];  // there is no noise about it
        Cell sum{};
        float weights[2] = {0.0f, 0.0f};
        each_tap(grid_, x, y, step_, [&](std::size_t q, int dx, int dy, float kernel) {
            const float far = feature_distance(p, features_[q], dx, dy);
            if (far > 20.0f) return;
            const float variance = kNoise * kNoise * (value.variance + values[q].variance) + 1e-20f;
            for (int h = 0; h < 2; ++h) {
                const float difference = values[q].half[1 - h] - value.half[1 - h];
                const float w = kernel * std::exp(-far - difference * difference / variance);
                sum.light[h] += w * from[q].light[h];
                sum.share[h] += w * from[q].share[h];
                weights[h] += w;
            }
        });
        for (int h = 0; h < 2; ++h) sum.light[h] /= weights[h], sum.share[h] /= weights[h];
        return sum;
    }

private:
    Grid grid_;
    const std::vector<Feature>& features_;
    int step_;
};

}  // namespace

Denoised denoise(const DenoisePlanes& planes, int threads, bool idle) {
    const Grid grid{planes.width_px, planes.height_px};
    const std::size_t count = planes.albedo.size();
    const auto each_pixel = [&](const auto& job) {
        parallel(grid.height, threads, idle, {}, [&](int y) {
            for (int x = 0; x < grid.width; ++x) job(x, y, grid.at(x, y));
        });
    };
    std::vector<Feature> features(count);
    std::vector<Cell> cells(count), next(count);
    std::vector<Value> values(count);
    each_pixel([&](int x, int y, std::size_t at) {
        features[at] = feature_at(planes, grid, x, y);
        const glm::vec3 above = 1.0f / (planes.albedo[at] + kLeastAlbedo);
        for (std::size_t h = 0; h < 2; ++h) {
            cells[at].light[h] = planes.half[h][at] * above;
            cells[at].share[h] = planes.albedo[at] * above;
        }
    });
    for (int level = 0; level < kLevels; ++level) {
        const Level transform(grid, features, 1 << level);
        each_pixel([&](int x, int y, std::size_t at) {
            values[at] = level == 0 ? transform.guide_at(cells, x, y) : value_of(cells[at]);
        });
        each_pixel([&](int x, int y, std::size_t at) { values[at].variance = transform.variance_at(values, x, y); });
        each_pixel([&](int x, int y, std::size_t at) { next[at] = transform.filtered_at(cells, values, x, y); });
        cells.swap(next);
    }
    Denoised result;
    result.radiance.resize(count);
    double squares = 0.0, mean = 0.0;
    for (std::size_t at = 0; at < count; ++at) {
        glm::vec3 half[2];
        for (int h = 0; h < 2; ++h)
            for (int k = 0; k < 3; ++k)
                half[h][k] = planes.albedo[at][k] * ratio(cells[at].light[h][k], cells[at].share[h][k]);
        result.radiance[at] = planes.exact[at] + 0.5f * (half[0] + half[1]);
        const double off = 0.5 * static_cast<double>(luminance(half[0] - half[1]));
        squares += off * off;
        mean += static_cast<double>(luminance(result.radiance[at]));
    }
    if (mean > 0.0) result.noise = std::sqrt(squares * static_cast<double>(count)) / mean;
    return result;
}

}  // namespace gonio::trace
