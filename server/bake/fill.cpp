#include "server/bake/fill.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gonio::bake {
namespace {

constexpr std::array<glm::ivec2, 8> kEightAround{
    {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};

constexpr char kComputed = 1, kFilled = 2;  // whether a pixel has a value, and which

// Calls job(neighbour) for the pixels around one.
template <typename Job>
void each_neighbour(const Atlas& atlas, std::int32_t pixel, Job job) {
    const int x = pixel % atlas.width, y = pixel / atlas.width;
    for (const glm::ivec2& step : kEightAround) {
        const int nx = x + step.x, ny = y + step.y;
        if (nx >= 0 && ny >= 0 && nx < atlas.width && ny < atlas.height) job(ny * atlas.width + nx);
    }
}

}  // namespace

FillPlan plan_fill(const Atlas& atlas) {
    FillPlan plan;
    const std::size_t pixels = static_cast<std::size_t>(atlas.width) * static_cast<std::size_t>(atlas.height);
    plan.sheet_at.assign(pixels, -1);
    std::vector<char> has(pixels, 0);
    for (const Texel& texel : atlas.texels) {
        plan.sheet_at[static_cast<std::size_t>(texel.pixel)] = texel.sheet;
        has[static_cast<std::size_t>(texel.pixel)] = texel.valid ? kComputed : 0;
    }
    plan.first.push_back(0);
    std::vector<std::int32_t> ring, next;
    const auto take = [&](const std::vector<std::int32_t>& some) {
        for (const std::int32_t pixel : some) {
            const std::int32_t sheet = plan.sheet_at[static_cast<std::size_t>(pixel)];
            plan.pixel.push_back(pixel);
            // Texels that were computed count more than those that were filled: these may lie behind a wall.
            for (const char wanted : {kComputed, kFilled}) {
                each_neighbour(atlas, pixel, [&](std::int32_t n) {
                    if (has[static_cast<std::size_t>(n)] == wanted &&
                        plan.sheet_at[static_cast<std::size_t>(n)] == sheet)
                        plan.source.push_back(n);
                });
                if (plan.source.size() > plan.first.back()) break;
            }
            plan.first.push_back(static_cast<std::uint32_t>(plan.source.size()));
        }
        for (const std::int32_t pixel : some) has[static_cast<std::size_t>(pixel)] = kFilled;
    };
    const auto reached = [&](std::int32_t pixel) {
        bool any = false;
        const std::int32_t sheet = plan.sheet_at[static_cast<std::size_t>(pixel)];
        each_neighbour(atlas, pixel, [&](std::int32_t n) {
            any = any || (has[static_cast<std::size_t>(n)] != 0 && plan.sheet_at[static_cast<std::size_t>(n)] == sheet);
        });
        return any;
    };
    // Invalid texels, from the edge of what is valid inwards.
    std::vector<std::int32_t> left;
    for (const Texel& texel : atlas.texels) {
        if (!texel.valid) left.push_back(texel.pixel);
    }
    while (!left.empty()) {
        ring.clear(), next.clear();
        for (const std::int32_t pixel : left) (reached(pixel) ? ring : next).push_back(pixel);
        if (ring.empty()) break;  // a sheet without a valid texel stays 0
        take(ring);
        left.swap(next);
    }
    // Gutters. A free pixel belongs to the sheet that reaches it first; of two, to the one with more texels beside it.
    std::vector<std::int32_t> front;
    for (const Texel& texel : atlas.texels) front.push_back(texel.pixel);
    for (int step = 0; step < kGutter; ++step) {
        ring.clear();
        std::vector<std::pair<std::int32_t, std::int32_t>> claims;
        for (const std::int32_t pixel : front) {
            each_neighbour(atlas, pixel, [&](std::int32_t n) {
                if (plan.sheet_at[static_cast<std::size_t>(n)] < 0)
                    claims.emplace_back(n, plan.sheet_at[static_cast<std::size_t>(pixel)]);
            });
        }
        std::sort(claims.begin(), claims.end());
        for (std::size_t i = 0; i < claims.size();) {
            const std::int32_t pixel = claims[i].first;
            std::int32_t best = -1;
            std::size_t most = 0;
            while (i < claims.size() && claims[i].first == pixel) {
                const std::int32_t sheet = claims[i].second;
                std::size_t count = 0;
                while (i < claims.size() && claims[i] == std::pair(pixel, sheet)) ++i, ++count;
                if (count > most) most = count, best = sheet;
            }
            plan.sheet_at[static_cast<std::size_t>(pixel)] = best;
            ring.push_back(pixel);
        }
        std::vector<std::int32_t> lit;
        for (const std::int32_t pixel : ring) {
            if (reached(pixel)) lit.push_back(pixel);
        }
        take(lit);
        front = ring;
    }
    return plan;
}

static void run(const FillPlan& plan, std::vector<float>& picture, int channels) {
    const auto n = static_cast<std::size_t>(channels);
    for (std::size_t i = 0; i < plan.pixel.size(); ++i) {
        float* const to = &picture[static_cast<std::size_t>(plan.pixel[i]) * n];
        const std::uint32_t begin = plan.first[i], end = plan.first[i + 1];
        for (std::size_t c = 0; c < n; ++c) {
            float sum = 0.0f;
            for (std::uint32_t s = begin; s < end; ++s)
                sum += picture[static_cast<std::size_t>(plan.source[s]) * n + c];
            to[c] = sum / static_cast<float>(end - begin);
        }
    }
}

std::vector<float> picture_of(const Atlas& atlas, const FillPlan& plan, std::span<const float> values, int channels) {
    const auto n = static_cast<std::size_t>(channels);
    std::vector<float> picture(static_cast<std::size_t>(atlas.width) * static_cast<std::size_t>(atlas.height) * n,
                               0.0f);
    for (std::size_t i = 0; i < atlas.texels.size(); ++i) {
        if (!atlas.texels[i].valid) continue;
        for (std::size_t c = 0; c < n; ++c)
            picture[static_cast<std::size_t>(atlas.texels[i].pixel) * n + c] = values[i * n + c];
    }
    run(plan, picture, channels);
    return picture;
}

void fill_invalid(const Atlas& atlas, const FillPlan& plan, std::span<float> values, int channels) {
    const auto n = static_cast<std::size_t>(channels);
    const auto texel = [&](std::int32_t pixel) {
        return static_cast<std::size_t>(atlas.texel_at[static_cast<std::size_t>(pixel)]);
    };
    for (std::size_t i = 0; i < plan.pixel.size(); ++i) {
        if (atlas.texel_at[static_cast<std::size_t>(plan.pixel[i])] < 0) break;  // gutters from here on
        const std::uint32_t begin = plan.first[i], end = plan.first[i + 1];
        for (std::size_t c = 0; c < n; ++c) {
            float sum = 0.0f;
            for (std::uint32_t s = begin; s < end; ++s) sum += values[texel(plan.source[s]) * n + c];
            values[texel(plan.pixel[i]) * n + c] = sum / static_cast<float>(end - begin);
        }
    }
}

float bilinear(std::span<const float> picture, int width, int height, int channels, int channel, const glm::dvec2& at) {
    const glm::dvec2 p = at - 0.5, low = glm::floor(p), part = p - low;
    const auto texel = [&](double x, double y) {
        const auto tx = static_cast<std::size_t>(std::clamp(static_cast<int>(x), 0, width - 1)),
                   ty = static_cast<std::size_t>(std::clamp(static_cast<int>(y), 0, height - 1));
        return static_cast<double>(
            picture[(ty * static_cast<std::size_t>(width) + tx) * static_cast<std::size_t>(channels) +
                    static_cast<std::size_t>(channel)]);
    };
    return static_cast<float>(
        (1.0 - part.y) * ((1.0 - part.x) * texel(low.x, low.y) + part.x * texel(low.x + 1, low.y)) +
        part.y * ((1.0 - part.x) * texel(low.x, low.y + 1) + part.x * texel(low.x + 1, low.y + 1)));
}

}  // namespace gonio::bake
