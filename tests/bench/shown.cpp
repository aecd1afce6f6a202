#include "tests/bench/shown.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "server/trace/sources.h"
#include "shaders/lib/as_cpp.h"

namespace gonio::bench {

using test::Picture;

namespace {

float byte_of(float encoded) {
    return std::round(std::clamp(encoded, 0.0f, 1.0f) * 255.0f) / 255.0f;
}

}  // namespace

std::vector<float> traced(const Scene& scene, std::uint32_t seed, unsigned samples) {
    trace::Settings settings;
    settings.seed = seed;
    settings.noise = 0.0;
    settings.max_passes = samples;
    trace::Picture picture(trace::make_world(scene),
                           {scene.camera, scene.width_px, scene.height_px, trace::Quantity::radiance, true}, settings);
    while (!picture.refine(10.0).complete) {
    }
    return picture.values();
}

Picture shown(const std::vector<float>& values, const Scene& scene) {
    Picture picture{scene.width_px, scene.height_px, {}};
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            const float* at = values.data() + 4 * static_cast<std::size_t>(y * picture.width + x);
            glm::vec3 encoded(glsl::background_shade());
            if (at[3] > 0.0f) {  // with the background surfaces mix as they are shown: captures do so too
                const glm::vec3 surfaces = glm::vec3(at[0], at[1], at[2]) / at[3];
                const glm::vec3 display = glsl::expose(surfaces, static_cast<float>(scene.exposure_ev100));
                encoded = glm::mix(encoded, glsl::encode_display(display, x, picture.height - 1 - y), at[3]);
            }
            picture.srgb.emplace_back(byte_of(encoded.r), byte_of(encoded.g), byte_of(encoded.b));
        }
    }
    return picture;
}

Picture shown(const CapturedPicture& still) {
    Picture picture{still.width_px, still.height_px, {}};
    for (std::size_t i = 0; i < still.rgba8.size(); i += 4)
        picture.srgb.emplace_back(glm::vec3(still.rgba8[i], still.rgba8[i + 1], still.rgba8[i + 2]) / 255.0f);
    return picture;
}

void write_ppm(const std::string& folder, const std::string& name, const Picture& picture) {
    if (folder.empty()) return;
    std::filesystem::create_directories(folder);
    std::ofstream out(std::filesystem::path(folder) / (name + ".ppm"), std::ios::binary);
    out << "P6\n" << picture.width << " " << picture.height << "\n255\n";
    for (const glm::vec3& pixel : picture.srgb) {
        for (int k = 0; k < 3; ++k) out.put(static_cast<char>(std::lround(pixel[k] * 255.0f)));
    }
}

}  // namespace gonio::bench
