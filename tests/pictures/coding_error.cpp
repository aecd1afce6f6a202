#include "tests/pictures/coding_error.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/gl/flip.h"

namespace gonio::test {
namespace {

constexpr int kBlock = 8;

double psnr_db(double squares, double count) {
    return squares > 0.0 ? std::min(100.0, 10.0 * std::log10(255.0 * 255.0 * count / squares)) : 100.0;
}

// Result: by block, row by row: the mean error of Y'; NaN where the block is not plain.
std::vector<double> plain_errors(const std::vector<std::uint8_t>& encoded, const std::vector<std::uint8_t>& decoded,
                                 int width_px, int height_px) {
    std::vector<double> errors;
    for (int top = 0; top + kBlock <= height_px; top += kBlock) {
        for (int left = 0; left + kBlock <= width_px; left += kBlock) {
            int least = 255, most = 0, sum = 0;
            for (int y = top; y < top + kBlock; ++y) {
                for (int x = left; x < left + kBlock; ++x) {
                    const auto at = static_cast<std::size_t>(y * width_px + x);
                    least = std::min<int>(least, encoded[at]);
                    most = std::max<int>(most, encoded[at]);
                    sum += decoded[at] - encoded[at];
                }
            }
            errors.push_back(most - least <= kPlainCodes ? sum / double{kBlock * kBlock} : std::nan(""));
        }
    }
    return errors;
}

double plain_step(const std::vector<double>& errors, int across) {
    std::vector<double> steps;
    for (std::size_t i = 0; i < errors.size(); ++i) {
        const bool last = (i + 1) % static_cast<std::size_t>(across) == 0;
        const std::size_t below = i + static_cast<std::size_t>(across);
        if (!last) steps.push_back(std::abs(errors[i] - errors[i + 1]));
        if (below < errors.size()) steps.push_back(std::abs(errors[i] - errors[below]));
    }
    std::erase_if(steps, [](double step) { return std::isnan(step); });
    if (steps.empty()) return 0.0;
    const auto at = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() * 99 / 100);
    std::nth_element(steps.begin(), at, steps.end());
    return *at;
}

double worst_block(const std::vector<float>& flips, int width_px, int height_px) {
    double worst = 0.0;
    for (int top = 0; top + kBlock <= height_px; top += kBlock) {
        for (int left = 0; left + kBlock <= width_px; left += kBlock) {
            double sum = 0.0;
            for (int y = top; y < top + kBlock; ++y)
                for (int x = left; x < left + kBlock; ++x)
                    sum += static_cast<double>(flips[static_cast<std::size_t>(y * width_px + x)]);
            worst = std::max(worst, sum / (kBlock * kBlock));
        }
    }
    return worst;
}

}  // namespace

CodingError coding_error(const std::vector<std::uint8_t>& encoded, const std::vector<std::uint8_t>& decoded,
                         int width_px, int height_px, bool with_flip) {
    CodingError error;
    const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
    double squares = 0.0;
    for (std::size_t i = 0; i < pixels; ++i) squares += std::pow(decoded[i] - encoded[i], 2.0);
    error.y_db = psnr_db(squares, static_cast<double>(pixels));
    const Picture a = picture_of_nv12(encoded, width_px, height_px), b = picture_of_nv12(decoded, width_px, height_px);
    squares = 0.0;
    for (std::size_t i = 0; i < pixels; ++i) {
        const glm::vec3 off = 255.0f * (b.srgb[i] - a.srgb[i]);
        squares += static_cast<double>(glm::dot(off, off));
    }
    error.rgb_db = psnr_db(squares, 3.0 * static_cast<double>(pixels));
    error.plain_step = plain_step(plain_errors(encoded, decoded, width_px, height_px), width_px / kBlock);
    if (!with_flip) return error;
    const std::vector<float> flips = flip(a, b);
    error.flip = std::accumulate(flips.begin(), flips.end(), 0.0) / static_cast<double>(flips.size());
    error.worst_block_flip = worst_block(flips, width_px, height_px);
    return error;
}

bool visually_lossless(const CodingError& error) {
    return error.y_db >= kLosslessDb && error.flip <= kLosslessFlip && error.worst_block_flip <= kLosslessBlockFlip;
}

}  // namespace gonio::test
