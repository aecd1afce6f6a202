#include "tests/bench/errors.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

namespace gonio::bench {
namespace {

// PCG output permutation (Jarzynski & Olano 2020, "Hash functions for GPU rendering").
std::uint32_t hash(std::uint32_t x) {
    x = x * 747796405u + 2891336453u;
    x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
    return (x >> 22u) ^ x;
}

// Result: the smallest value that at least the share of all values does not exceed.
double percentile(std::vector<double> values, double share) {
    if (values.empty()) return 0.0;
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

}  // namespace

std::vector<glm::ivec2> stratified_pixels(int width_px, int height_px, int cells) {
    const int columns = std::min(cells, width_px), rows = std::min(cells, height_px);
    std::vector<glm::ivec2> pixels;
    pixels.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
            const int x0 = width_px * i / columns, x1 = width_px * (i + 1) / columns;
            const int y0 = height_px * j / rows, y1 = height_px * (j + 1) / rows;
            const std::uint32_t h = hash(static_cast<std::uint32_t>(j * columns + i));
            pixels.emplace_back(x0 + static_cast<int>(h % static_cast<std::uint32_t>(x1 - x0)),
                                y0 + static_cast<int>(hash(h) % static_cast<std::uint32_t>(y1 - y0)));
        }
    }
    return pixels;
}

Errors errors_of(std::span<const double> shown, std::span<const double> reference, std::span<const double> variance) {
    Errors errors;
    const std::size_t n = reference.size();
    const double mean = std::accumulate(reference.begin(), reference.end(), 0.0) / static_cast<double>(n);
    if (n == 0 || !(mean > 0.0)) return errors;
    std::vector<double> relative(n);
    std::vector<std::size_t> order(n);
    std::vector<double> squared(n);
    double signed_sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        const double difference = shown[i] - reference[i];
        order[i] = i;
        squared[i] = difference * difference;
        signed_sum += difference;
        relative[i] = std::abs(difference) / std::max(reference[i], 0.05 * mean);
    }
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return squared[a] < squared[b]; });
    const auto root = [&](std::size_t kept) {
        double sum = 0.0, own = 0.0;
        for (std::size_t k = 0; k < kept; ++k) {
            sum += squared[order[k]];
            own += variance.empty() ? 0.0 : variance[order[k]];
        }
        return std::sqrt(std::max(sum - own, 0.0) / static_cast<double>(kept)) / mean;
    };
    errors.rmse = root(n);
    errors.rmse99 = root(n - n / 100);
    errors.p95 = percentile(relative, 0.95);
    errors.p99 = percentile(relative, 0.99);
    errors.bias = signed_sum / static_cast<double>(n) / mean;
    errors.noise =
        variance.empty()
            ? 0.0
            : std::sqrt(std::accumulate(variance.begin(), variance.end(), 0.0) / static_cast<double>(n)) / mean;
    return errors;
}

std::vector<std::size_t> pareto_front(std::span<const glm::dvec2> points) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (std::isfinite(points[i].x) && std::isfinite(points[i].y)) order.push_back(i);
    }
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return points[a].x != points[b].x ? points[a].x < points[b].x : points[a].y < points[b].y;
    });
    std::vector<std::size_t> front;
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t i : order) {
        if (points[i].y >= best) continue;
        best = points[i].y;
        front.push_back(i);
    }
    return front;
}

}  // namespace gonio::bench
