#include "server/exchange/gobo_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "ies/core/srgb.h"
#include "server/assets/gltf_import.h"
#include "server/scene/packed_gobo.h"

namespace gonio::exchange {
namespace {

int side_of(int width_px, int height_px) {
    return std::min(std::max(width_px, height_px), kMostGobo_px);
}

std::vector<std::uint16_t> transmissions_of(const Image& image) {
    const int size_px = side_of(image.width_px, image.height_px);
    std::array<double, 256> linear{};
    for (std::size_t i = 0; i < linear.size(); ++i) {
        const double value = static_cast<double>(i) / 255.0;
        linear[i] = image.linear ? value : linear_of_srgb(value);
    }
    std::vector<double> passes(static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px));
    for (std::size_t i = 0; i < passes.size(); ++i)
        passes[i] = (0.2126 * linear[image.rgba[4 * i]] + 0.7152 * linear[image.rgba[4 * i + 1]] +
                     0.0722 * linear[image.rgba[4 * i + 2]]) *
                    image.rgba[4 * i + 3] / 255.0;
    const auto begin = [&](int at, int of_px) {
        return static_cast<int>(static_cast<std::int64_t>(at) * of_px / size_px);
    };
    std::vector<std::uint16_t> made;
    made.reserve(static_cast<std::size_t>(size_px) * static_cast<std::size_t>(size_px));
    for (int y = 0; y < size_px; ++y)
        for (int x = 0; x < size_px; ++x) {
            const int x0 = begin(x, image.width_px), x1 = std::max(begin(x + 1, image.width_px), x0 + 1);
            const int y0 = begin(y, image.height_px), y1 = std::max(begin(y + 1, image.height_px), y0 + 1);
            double sum = 0.0;
            for (int v = y0; v < y1; ++v)
                for (int u = x0; u < x1; ++u) sum += passes[static_cast<std::size_t>(v * image.width_px + u)];
            made.push_back(
                static_cast<std::uint16_t>(std::lround(65535.0 * std::min(sum / ((x1 - x0) * (y1 - y0)), 1.0))));
        }
    return made;
}

Result<std::vector<std::uint16_t>> decode_gobo(std::string_view bytes, const std::string& place) {
    const auto image = decode_image(std::as_bytes(std::span(bytes)), place, kMostGoboPicturePixels);
    if (!image) return image.error();
    return transmissions_of(*image);
}

}  // namespace

Result<Gobo> packed_gobo(std::string bytes, const std::string& place) {
    const auto size = image_size(std::as_bytes(std::span(bytes)), place, kMostGoboPicturePixels);
    if (!size) return size.error();
    auto packed = std::make_shared<PackedGobo>();
    packed->bytes = std::move(bytes);
    packed->place = place;
    packed->decode = decode_gobo;
    Gobo gobo;
    gobo.size_px = side_of(size->width_px, size->height_px);
    gobo.packed = std::move(packed);
    return gobo;
}

}  // namespace gonio::exchange
