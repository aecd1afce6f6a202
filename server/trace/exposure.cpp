#include "server/trace/exposure.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "server/trace/sources.h"

namespace gonio::trace {

namespace {

// Result: the luminances of a small picture's pixels that show a surface, or of their illuminances, ascending.
std::vector<double> metered_values(const Scene& scene, Quantity quantity) {
    constexpr int kSide_px = 32;
    constexpr std::uint32_t kPasses = 8;
    PictureRequest request;
    request.camera = scene.camera;
    request.quantity = quantity;
    request.openings = request.bodies = false;  // what they light tells the exposure
    const auto side_px = [&](int own, int other) { return std::clamp(kSide_px * own / other, kSide_px, 4 * kSide_px); };
    request.width_px = side_px(scene.width_px, scene.height_px);
    request.height_px = side_px(scene.height_px, scene.width_px);
    Settings settings;
    settings.noise = 0.0;
    settings.max_passes = kPasses;
    settings.threads = 1;
    Picture picture(make_world(scene), request, settings);
    while (!picture.refine(1.0).complete) {
    }
    const std::vector<float> values = picture.values();
    std::vector<double> sizes;
    for (std::size_t i = 0; i < values.size(); i += 4)
        if (values[i + 3] > 0.0f) sizes.push_back(luminance(glm::dvec3(values[i], values[i + 1], values[i + 2])));
    std::sort(sizes.begin(), sizes.end());
    return sizes;
}

}  // namespace

std::optional<double> metered_ev100(const Scene& scene) {
    constexpr double kKey = 0.4, kLow = 0.5, kHigh = 0.98;
    constexpr double kBrightest = 1.3;  // of white: beyond it the tone curve leaves no detail (display.glsl)
    const std::vector<double> nits = metered_values(scene, Quantity::radiance);
    if (nits.empty()) return std::nullopt;
    const auto place = [&](double share) { return static_cast<std::size_t>(share * static_cast<double>(nits.size())); };
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = place(kLow); i < std::max(place(kHigh), place(kLow) + 1); ++i) {
        if (!(nits[i] > 0.0)) continue;
        sum += std::log2(nits[i]);
        ++count;
    }
    if (count == 0) return std::nullopt;
    const double highlight_nit = nits[std::min(place(kHigh), nits.size() - 1)];
    return within_exposure(std::max(sum / static_cast<double>(count) - std::log2(1.2 * kKey),
                                    std::log2(highlight_nit / (1.2 * kBrightest))));
}

std::optional<double> metered_range(const Scene& scene, View view) {
    constexpr double kShare = 0.99;
    const std::vector<double> values =
        metered_values(scene, view == View::illuminance ? Quantity::irradiance : Quantity::radiance);
    if (values.empty()) return std::nullopt;
    const double most = values[static_cast<std::size_t>(kShare * static_cast<double>(values.size() - 1))];
    if (!(most > 0.0)) return std::nullopt;
    const double decade = std::pow(10.0, std::floor(std::log10(most)));
    for (const double mantissa : {1.0, 2.0, 5.0})
        if (mantissa * decade >= most) return mantissa * decade;
    return 10.0 * decade;
}

}  // namespace gonio::trace
