#include "tests/gl/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace gonio::test {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

struct Planes {
    int width, height;
    std::array<std::vector<float>, 3> plane;
};

// The matrix of IEC 61966-2-1; white is what it makes of (1, 1, 1).
glm::vec3 xyz_of(const glm::vec3& rgb) {
    return {0.4124564f * rgb.r + 0.3575761f * rgb.g + 0.1804375f * rgb.b,
            0.2126729f * rgb.r + 0.7151522f * rgb.g + 0.0721750f * rgb.b,
            0.0193339f * rgb.r + 0.1191920f * rgb.g + 0.9503041f * rgb.b};
}
glm::vec3 rgb_of(const glm::vec3& xyz) {
    return {3.2404542f * xyz.x - 1.5371385f * xyz.y - 0.4985314f * xyz.z,
            -0.9692660f * xyz.x + 1.8760108f * xyz.y + 0.0415560f * xyz.z,
            0.0556434f * xyz.x - 0.2040259f * xyz.y + 1.0572252f * xyz.z};
}
glm::vec3 white() {
    return xyz_of(glm::vec3(1.0f));
}

float linear(float encoded) {
    return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

// Opponent colours whose channels the contrast sensitivity of the eye is known for.
glm::vec3 ycxcz_of(const glm::vec3& linear_rgb) {
    const glm::vec3 w = xyz_of(linear_rgb) / white();
    return {116.0f * w.y - 16.0f, 500.0f * (w.x - w.y), 200.0f * (w.y - w.z)};
}
glm::vec3 linear_of_ycxcz(const glm::vec3& c) {
    const float y = (c.x + 16.0f) / 116.0f;
    return rgb_of(glm::vec3(y + c.y / 500.0f, y, y - c.z / 200.0f) * white());
}

// CIELab with the Hunt effect: chroma counts less in the dark.
glm::vec3 hunt_lab_of(const glm::vec3& linear_rgb) {
    const glm::vec3 w = xyz_of(linear_rgb) / white();
    constexpr float kDelta = 6.0f / 29.0f;
    const auto f = [](float t) {
        return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3.0f * kDelta * kDelta) + 4.0f / 29.0f;
    };
    const float light = 116.0f * f(w.y) - 16.0f;
    return {light, 0.01f * light * 500.0f * (f(w.x) - f(w.y)), 0.01f * light * 200.0f * (f(w.y) - f(w.z))};
}
float hyab(const glm::vec3& a, const glm::vec3& b) {
    return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z);
}

// A separable filter with its middle at weights.size() / 2, edges repeated.
std::vector<float> filtered(const std::vector<float>& in, int width, int height, const std::vector<float>& along_x,
                            const std::vector<float>& along_y) {
    const int radius = static_cast<int>(along_x.size() / 2);
    std::vector<float> rows(in.size()), out(in.size(), 0.0f), padded(static_cast<std::size_t>(width + 2 * radius));
    for (int y = 0; y < height; ++y) {
        const float* from = &in[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
        for (int x = -radius; x < width + radius; ++x)
            padded[static_cast<std::size_t>(x + radius)] = from[std::clamp(x, 0, width - 1)];
        float* to = &rows[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
        for (std::size_t k = 0; k < along_x.size(); ++k) {
            for (int x = 0; x < width; ++x) to[x] += along_x[k] * padded[static_cast<std::size_t>(x) + k];
        }
    }
    for (int y = 0; y < height; ++y) {
        float* to = &out[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
        for (int k = -radius; k <= radius; ++k) {
            const float* from =
                &rows[static_cast<std::size_t>(std::clamp(y + k, 0, height - 1)) * static_cast<std::size_t>(width)];
            for (int x = 0; x < width; ++x) to[x] += along_y[static_cast<std::size_t>(k + radius)] * from[x];
        }
    }
    return out;
}

// The eye's contrast sensitivity in one channel, as a sum of Gaussians of the angle: a · sqrt(pi / b) · exp(−pi² x² /
// b).
struct Sensitivity {
    float a1, b1, a2, b2;
};
constexpr Sensitivity kSensitivity[3] = {
    {1.0f, 0.0047f, 0.0f, 1e-5f}, {1.0f, 0.0053f, 0.0f, 1e-5f}, {34.1f, 0.04f, 13.5f, 0.025f}};

std::vector<float> blurred(const std::vector<float>& in, int width, int height, const Sensitivity& s,
                           float per_degree) {
    const int radius = static_cast<int>(std::ceil(3.0f * std::sqrt(0.04f / (2.0f * kPi * kPi)) * per_degree));
    // The two-dimensional sum is of two separable parts, whose shares follow from their sums over the pixels.
    std::vector<float> result(in.size(), 0.0f);
    float parts[2], total = 0.0f;
    std::vector<float> weights[2];
    for (int part = 0; part < 2; ++part) {
        const float a = part == 0 ? s.a1 : s.a2, b = part == 0 ? s.b1 : s.b2;
        for (int k = -radius; k <= radius; ++k) {
            const float x = static_cast<float>(k) / per_degree;
            weights[part].push_back(std::exp(-kPi * kPi * x * x / b));
        }
        const float sum = std::accumulate(weights[part].begin(), weights[part].end(), 0.0f);
        parts[part] = a * std::sqrt(kPi / b) * sum * sum;
        total += parts[part];
        for (float& weight : weights[part]) weight /= sum;
    }
    for (int part = 0; part < 2; ++part) {
        if (!(parts[part] > 0.0f)) continue;
        const std::vector<float> one = filtered(in, width, height, weights[part], weights[part]);
        for (std::size_t i = 0; i < in.size(); ++i) result[i] += parts[part] / total * one[i];
    }
    return result;
}

Planes opponent(const Picture& picture) {
    Planes planes{picture.width, picture.height, {}};
    for (auto& plane : planes.plane) plane.resize(picture.srgb.size());
    for (std::size_t i = 0; i < picture.srgb.size(); ++i) {
        const glm::vec3 c = picture.srgb[i];
        const glm::vec3 ycc = ycxcz_of({linear(c.r), linear(c.g), linear(c.b)});
        for (int k = 0; k < 3; ++k) planes.plane[static_cast<std::size_t>(k)][i] = ycc[k];
    }
    return planes;
}

// What the eye takes for colours at this distance.
std::vector<glm::vec3> seen_colours(const Planes& planes, float per_degree) {
    std::vector<float> seen[3];
    for (std::size_t k = 0; k < 3; ++k)
        seen[k] = blurred(planes.plane[k], planes.width, planes.height, kSensitivity[k], per_degree);
    std::vector<glm::vec3> result(seen[0].size());
    for (std::size_t i = 0; i < result.size(); ++i)
        result[i] = hunt_lab_of(glm::clamp(linear_of_ycxcz({seen[0][i], seen[1][i], seen[2][i]}), 0.0f, 1.0f));
    return result;
}

// Strength of edges and of points of the lightness.
struct Features {
    std::vector<float> edges, points;
};
Features features_of(const Planes& planes, float per_degree) {
    constexpr float kWidthDegrees = 0.082f;  // of a feature
    const float deviation = 0.5f * kWidthDegrees * per_degree;
    const int radius = static_cast<int>(std::ceil(3.0f * deviation));
    std::vector<float> gauss, first, second;
    for (int k = -radius; k <= radius; ++k) {
        const float x = static_cast<float>(k), g = std::exp(-x * x / (2.0f * deviation * deviation));
        gauss.push_back(g);
        first.push_back(-x * g);
        second.push_back((x * x / (deviation * deviation) - 1.0f) * g);
    }
    const float sum = std::accumulate(gauss.begin(), gauss.end(), 0.0f);
    for (float& weight : gauss) weight /= sum;
    for (std::vector<float>* weights : {&first, &second}) {  // positive and negative parts sum to 1 and −1
        float positive = 0.0f, negative = 0.0f;
        for (float weight : *weights) (weight > 0.0f ? positive : negative) += std::abs(weight);
        for (float& weight : *weights) weight /= weight > 0.0f ? positive : negative;
    }
    std::vector<float> light(planes.plane[0].size());
    for (std::size_t i = 0; i < light.size(); ++i) light[i] = (planes.plane[0][i] + 16.0f) / 116.0f;
    const auto strength = [&](const std::vector<float>& along) {
        std::vector<float> x = filtered(light, planes.width, planes.height, along, gauss);
        const std::vector<float> y = filtered(light, planes.width, planes.height, gauss, along);
        for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::hypot(x[i], y[i]);
        return x;
    };
    return {strength(first), strength(second)};
}

}  // namespace

Picture picture_of_nv12(const std::vector<std::uint8_t>& nv12, int width, int height) {
    Picture picture{width, height, {}};
    const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
    for (std::size_t y = 0; y < h; ++y) {
        for (std::size_t x = 0; x < w; ++x) {
            const std::size_t chroma = w * h + y / 2 * w + x / 2 * 2;
            const float luma = (static_cast<float>(nv12[y * w + x]) - 16.0f) / 219.0f,
                        cb = (static_cast<float>(nv12[chroma]) - 128.0f) / 224.0f,
                        cr = (static_cast<float>(nv12[chroma + 1]) - 128.0f) / 224.0f;
            const float r = luma + 1.5748f * cr, b = luma + 1.8556f * cb;
            picture.srgb.push_back(
                glm::clamp(glm::vec3(r, (luma - 0.2126f * r - 0.0722f * b) / 0.7152f, b), 0.0f, 1.0f));
        }
    }
    return picture;
}

std::vector<float> flip(const Picture& reference, const Picture& shown, float pixels_per_degree) {
    const Planes a = opponent(reference), b = opponent(shown);
    const std::vector<glm::vec3> colours_a = seen_colours(a, pixels_per_degree),
                                 colours_b = seen_colours(b, pixels_per_degree);
    const Features features_a = features_of(a, pixels_per_degree), features_b = features_of(b, pixels_per_degree);
    // The greatest difference of colours, and where the scale bends: 40 % of it count 95 %.
    constexpr float kExponent = 0.7f, kBendAt = 0.4f, kBendCounts = 0.95f;
    const float greatest = std::pow(hyab(hunt_lab_of({0, 1, 0}), hunt_lab_of({0, 0, 1})), kExponent);
    std::vector<float> result(colours_a.size());
    for (std::size_t i = 0; i < result.size(); ++i) {
        const float off = std::pow(hyab(colours_a[i], colours_b[i]), kExponent), bend = kBendAt * greatest;
        const float colour = off < bend ? off * kBendCounts / bend
                                        : kBendCounts + (off - bend) / (greatest - bend) * (1.0f - kBendCounts);
        const float feature = std::sqrt(std::max(std::abs(features_a.edges[i] - features_b.edges[i]),
                                                 std::abs(features_a.points[i] - features_b.points[i])) /
                                        std::numbers::sqrt2_v<float>);
        result[i] = std::pow(colour, 1.0f - feature);
    }
    return result;
}

double mean_flip(const Picture& reference, const Picture& shown) {
    const std::vector<float> all = flip(reference, shown);
    return std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size());
}

}  // namespace gonio::test
