#include "tests/bench/frames.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "server/assets/assets.h"
#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/stream/encode_thread.h"

namespace gonio {
namespace {

struct Setting {
    const char* technique;
    unsigned samples;
};
constexpr Setting kSettings[] = {{"seed", 400}, {"seed", 100}, {"seed-disk", 400}, {"default", kDefaultVpls}};

struct Row {
    std::string scene, technique;
    std::size_t triangles = 0;
    unsigned samples = 0;
    std::vector<double> frame_ms;
    double indirect_ms = 0.0;  // vpl + gather, mean
};

// The luminaire wanders on a circle of 5 cm, so that every pass that depends on it runs in every frame.
Row measure(Renderer& renderer, EncodeThread& encoder, const Setting& setting, const FramesOptions& options,
            const std::shared_ptr<const SceneAsset>& asset) {
    Scene scene = scene_of(asset);
    scene.width_px = options.width_px & ~1;
    scene.height_px = options.height_px & ~1;
    scene.technique = std::string(setting.technique) == "default" ? Technique::standard
                      : std::string(setting.technique) == "seed"  ? Technique::seed
                                                                  : Technique::seed_disk;
    scene.samples = setting.samples;
    const glm::dvec3 home = scene.lights.at(0).position;
    Row row{asset->name, setting.technique, asset->triangles(), setting.samples, {}, 0.0};
    double spent_ms = 0.0;
    for (int frame = -2; frame < 50 && (frame < 5 || spent_ms < options.seconds * 1e3); ++frame) {
        scene.lights[0].position = home + 0.05 * glm::dvec3(std::cos(0.3 * frame), 0.0, std::sin(0.3 * frame));
        scene.lights[0].position_rev = scene.lights[0].aim_rev = scene.camera_rev = ++scene.scene_rev;
        renderer.begin_frame(scene, monotonic_ns());
        auto done = renderer.finish_frame(true);
        encoder.put({{done->report.scene_rev(), done->width_px, done->height_px, done->nv12, done->drained_ns,
                      done->rendered_ns},
                     true,
                     false,
                     false,
                     false});
        if (frame < 0) continue;  // shaders are compiled in the first frames
        spent_ms += done->report.frame_ms();
        row.frame_ms.push_back(done->report.frame_ms());
        for (const v1::PassReport& pass : done->report.passes()) {
            if (pass.name() == "vpl" || pass.name() == "occlusion" || pass.name() == "gather")
                row.indirect_ms += std::max(pass.cpu_ms(), pass.gpu_ms());
        }
    }
    row.indirect_ms /= static_cast<double>(row.frame_ms.size());
    std::sort(row.frame_ms.begin(), row.frame_ms.end());
    return row;
}

double mean(const std::vector<double>& values) {
    double sum = 0.0;
    for (double v : values) sum += v;
    return sum / static_cast<double>(values.size());
}

void print_table(const std::vector<Row>& rows, std::ostream& out) {
    std::string scene;
    for (const Row& row : rows) {
        if (row.scene != scene) {
            scene = row.scene;
            out << "\n"
                << scene << " (" << row.triangles << " triangles)\n"
                << "technique  samples   min FPS   max FPS   average FPS   median ms   indirect ms   frames\n";
        }
        out << std::left << std::setw(11) << row.technique << std::right << std::setw(7) << row.samples << std::fixed
            << std::setprecision(2) << std::setw(10) << 1e3 / row.frame_ms.back() << std::setw(10)
            << 1e3 / row.frame_ms.front() << std::setw(14) << 1e3 / mean(row.frame_ms) << std::setw(12)
            << row.frame_ms[row.frame_ms.size() / 2] << std::setw(14) << row.indirect_ms << std::setw(9)
            << row.frame_ms.size() << "\n";
    }
}

void print_json(const std::vector<Row>& rows, const std::string& renderer, const FramesOptions& options,
                std::ostream& out) {
    nlohmann::json json = {{"renderer", renderer},
                           {"size", {options.width_px, options.height_px}},
                           {"threads", std::thread::hardware_concurrency()}};
    for (const Row& row : rows) {
        json["rows"].push_back({{"scene", row.scene},
                                {"triangles", row.triangles},
                                {"technique", row.technique},
                                {"samples", row.samples},
                                {"frame_ms", row.frame_ms[row.frame_ms.size() / 2]},
                                {"frame_p95_ms", row.frame_ms[row.frame_ms.size() * 95 / 100]},
                                {"fps_min", 1e3 / row.frame_ms.back()},
                                {"fps_max", 1e3 / row.frame_ms.front()},
                                {"fps_average", 1e3 / mean(row.frame_ms)},
                                {"indirect_ms", row.indirect_ms},
                                {"frames", row.frame_ms.size()}});
    }
    out << json.dump(2) << "\n";
}

}  // namespace

void run_frames(const FramesOptions& options, std::ostream& out) {
    const auto context = gl::Context::create({options.device, false});
    EncodeThread encoder({[](EncodedFrame, bool) {}, [](EncodedFrame) {}, [](const std::string&, int, int) {}, [] {}});
    std::vector<Row> rows;
    std::vector<std::string> names = {"cornell", "atrium"};
    if (!options.scene.empty()) names = {options.scene};
    for (const std::string& name : names) {
        const auto asset = load_scene(name);
        if (!asset) throw std::runtime_error(asset.error().text());
        if ((*asset)->lights.empty())
            throw std::runtime_error("the scene '" + name + "' has no luminaire to measure with");
        Renderer renderer(*context);
        for (const Setting& setting : kSettings) rows.push_back(measure(renderer, encoder, setting, options, *asset));
    }
    if (options.json) return print_json(rows, context->renderer(), options, out);
    out << context->description() << "; " << std::thread::hardware_concurrency() << " threads; " << options.width_px
        << "x" << options.height_px << "; everything recomputed in each frame, one luminaire moving\n";
    print_table(rows, out);
}

}  // namespace gonio
