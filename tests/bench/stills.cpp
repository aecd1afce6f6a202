#include "tests/bench/stills.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>
#include <vector>

#include "server/base/clock.h"
#include "server/render/renderer.h"
#include "server/scene/scene.h"
#include "server/session/traced_capture.h"
#include "tests/bench/cases.h"
#include "tests/bench/shown.h"

namespace gonio::bench {
namespace {

using test::Picture;

std::vector<float> half_of(const StillsOptions& options, const std::string& name, const Scene& scene,
                           std::uint32_t half) {
    const std::filesystem::path file =
        options.cache /
        ("still-" + name + "-" + std::to_string(scene.width_px) + "x" + std::to_string(scene.height_px) + "-" +
         std::to_string(options.samples) + "-" + std::to_string(half) + ".raw");
    std::vector<float> values(std::size_t{4} * scene.width_px * scene.height_px);
    const auto bytes = static_cast<std::streamsize>(values.size() * sizeof(float));
    if (std::ifstream in(file, std::ios::binary); in.read(reinterpret_cast<char*>(values.data()), bytes)) return values;
    values = traced(scene, 1 + half, options.samples / 2);
    std::filesystem::create_directories(options.cache);
    std::ofstream out(file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(values.data()), bytes);
    if (!out) throw std::runtime_error("cannot write " + file.string());
    return values;
}

constexpr std::uint32_t kDenoised[] = {16, 32, 64, 128};  // samples a pixel

struct StillRow {
    std::string scene;
    double one = 0.0, all = 0.0, halves = 0.0;    // FLIP
    double denoised[std::size(kDenoised)] = {};   // FLIP
    double one_seconds = 0.0, all_seconds = 0.0;  // of a second capture each
};

Picture denoised(const std::shared_ptr<const trace::World>& world, const Scene& scene, std::uint32_t samples) {
    constexpr std::uint32_t kOtherSeed = 7;  // than the reference's
    CaptureRequest request{Quality::reference, View::beauty, "png", scene.width_px, scene.height_px};
    request.denoise = true;
    request.settings.seed = kOtherSeed;
    request.settings.noise = 0.0;
    request.settings.max_passes = samples;
    return shown(trace_capture(world, scene, request, {}, [](const trace::Progress&) {})->picture);
}

StillRow measure(const gl::Context& context, const std::string& name, const StillsOptions& options) {
    Scene scene = scene_of_case({name, "wide"});
    scene.width_px = options.width_px, scene.height_px = options.height_px;
    const std::vector<float> a = half_of(options, name, scene, 0), b = half_of(options, name, scene, 1);
    std::vector<float> mean(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) mean[i] = 0.5f * (a[i] + b[i]);
    const Picture truth = shown(mean, scene);
    Renderer renderer(context);
    renderer.set_links(transport::kMostLinks);
    StillRow row{name};
    const auto capture = [&](unsigned samples, double& seconds) {
        std::shared_ptr<const CapturedPicture> still;
        for (int i = 0; i < 2; ++i) {  // the first compiles shaders and makes links
            const std::int64_t began_ns = monotonic_ns();
            still = renderer.capture(scene, View::beauty, scene.width_px, scene.height_px, false, trace::kAllBounces,
                                     samples);
            seconds = seconds_since(began_ns);
        }
        return shown(*still);
    };
    const Picture one = capture(1, row.one_seconds), all = capture(kSamplesPerPixel, row.all_seconds);
    row.one = test::mean_flip(truth, one);
    row.all = test::mean_flip(truth, all);
    row.halves = test::mean_flip(shown(a, scene), shown(b, scene));
    const auto world = trace::make_world(scene);
    for (std::size_t i = 0; i < std::size(kDenoised); ++i) {
        const Picture picture = denoised(world, scene, kDenoised[i]);
        row.denoised[i] = test::mean_flip(truth, picture);
        write_ppm(options.pictures, name + "-denoised-" + std::to_string(kDenoised[i]), picture);
    }
    write_ppm(options.pictures, name + "-1", one);
    write_ppm(options.pictures, name + "-16", all);
    write_ppm(options.pictures, name + "-reference", truth);
    return row;
}

}  // namespace

void run_stills(const StillsOptions& options, std::ostream& out, std::ostream& progress) {
    const auto context = gl::Context::create({options.device, false});
    std::vector<StillRow> rows;
    for (const char* scene : {"cornell", "atrium", "corridor", "stage"}) {
        if (!options.scene.empty() && options.scene != scene) continue;
        progress << scene << "\n";
        rows.push_back(measure(*context, scene, options));
    }
    if (rows.empty()) throw std::runtime_error("no scene is left: see gonio-bench stills --help");
    if (options.json) {
        nlohmann::json json = {{"renderer", context->renderer()}, {"samples", options.samples}};
        for (const StillRow& row : rows)
            json["rows"].push_back({{"scene", row.scene},
                                    {"flip_one_sample", row.one},
                                    {"flip", row.all},
                                    {"flip_halves", row.halves},
                                    {"flip_denoised", row.denoised},
                                    {"seconds_one_sample", row.one_seconds},
                                    {"seconds", row.all_seconds}});
        out << json.dump(2) << "\n";
        return;
    }
    out << "FLIP     1 sample  16 samples  halves   seconds: 1 sample  16 samples   denoised, of";
    for (const std::uint32_t samples : kDenoised) out << std::setw(8) << samples;
    out << "\n" << std::fixed;
    for (const StillRow& row : rows) {
        out << std::left << std::setw(9) << row.scene << std::right << std::setprecision(4) << std::setw(8) << row.one
            << std::setw(12) << row.all << std::setw(8) << row.halves << std::setprecision(2) << std::setw(20)
            << row.one_seconds << std::setw(12) << row.all_seconds << std::setw(15) << "" << std::setprecision(4);
        for (const double flip : row.denoised) out << std::setw(8) << flip;
        out << "\n";
    }
}

}  // namespace gonio::bench
